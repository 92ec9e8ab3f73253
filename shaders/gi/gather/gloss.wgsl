//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/lobe.wgsl

// Rays into lobes: which cells send one, and when.

// Squares of 2×2 cells.
fn gloss_grid() -> vec2u {
    return (cell_grid() + 1u) / 2u;
}

// Cell of a square whose turn it is.
fn gloss_cell(square: vec2u) -> vec2u {
    let turn = array<vec2u, 4>(vec2u(0u, 0u), vec2u(1u, 1u), vec2u(1u, 0u), vec2u(0u, 1u))[gather.frame & 3u];
    return 2u * square + turn;
}

// Number of a square's ray among all.
fn gloss_record(square: vec2u) -> u32 {
    return gather.cells + square.y * gloss_grid().x + square.x;
}
