//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/lobe.wgsl

// Specular rays of cells: which cell of a square of 2×2 sends one, and when.

// Squares of 2×2 cells.
fn specular_grid() -> vec2u {
    return (cell_grid() + 1u) / 2u;
}

// Cell of a square that sends its specular ray in this frame.
fn specular_cell(square: vec2u) -> vec2u {
    let phase = array<vec2u, 4>(vec2u(0u, 0u), vec2u(1u, 1u), vec2u(1u, 0u), vec2u(0u, 1u))[turn_of_four() & 3u];
    return 2u * square + phase;
}

// Index of a square's record.
fn specular_record(square: vec2u) -> u32 {
    return gather.cells + square.y * specular_grid().x + square.x;
}
