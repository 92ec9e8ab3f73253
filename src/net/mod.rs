//! Networks: weights format, graph, plan, CPU twin, GPU kernels.
