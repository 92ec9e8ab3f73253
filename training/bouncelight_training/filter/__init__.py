"""The network that guides `gather`'s filter over neighbouring cells: what it learns from, the filter as torch computes it, training."""
