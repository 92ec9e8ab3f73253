// Which lights can reach a tile of 16x16 pixels: a bit for each, 32 a word, two lists a tile: for
// what the G-buffer shows there, and for whatever is before it. A list has room for all lights, so
// that none is left out however many there are.

struct LightShadow {
    // First shadow view and how many; none means unshadowed.
    first: u32,
    count: u32,
    // Distance from which on the light is left out, metres.
    reach: f32,
    pad0: u32,
}

const TILE: u32 = 16u;

// First word of the list of the tile that `pixel` lies in.
fn light_list(pixel: vec2u, size: vec2u, words: u32, before: bool) -> u32 {
    let across = (size.x + TILE - 1u) / TILE;
    let tile = pixel / TILE;
    return ((tile.y * across + tile.x) * 2u + u32(before)) * words;
}
