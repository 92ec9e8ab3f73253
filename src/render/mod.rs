//! The rasteriser: one pass, one file; `frame` tells the order.
