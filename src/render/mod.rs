//! The rasteriser: one pass, one file; `frame` tells the order.

pub mod tonemap_curve;
