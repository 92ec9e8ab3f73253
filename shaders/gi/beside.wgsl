// Spheres that stand in for small objects, right beside a surface: gi.contact finds which may count in each square of
// TILE² pixels, gi.upsample asks them at every pixel. The prelude (gi::contact) holds TILE, MOST_SPHERES and SPHERE_REACH.

// Words of 32 bits that a tile has, one bit for each of `count` spheres.
fn sphere_words(count: u32) -> u32 {
    return (min(count, MOST_SPHERES) + 31u) / 32u;
}

// Where the words of a tile begin.
fn tile_start(tile: vec2u, words: u32) -> u32 {
    return words * (tile.y * ((params.size.x + TILE - 1u) / TILE) + tile.x);
}

// True where a sphere about `c` (view space) can count in the wedge between `low` and `high`, the tile's corners at distance 1,
// and between its nearest and farthest surface.
fn may_count(c: vec3f, radius: f32, low: vec2f, high: vec2f, depths: vec2f) -> bool {
    let reach = SPHERE_REACH * radius;
    let over_low = (c.xy + low * c.z) * inverseSqrt(1.0 + low * low);
    let under_high = -(c.xy + high * c.z) * inverseSqrt(1.0 + high * high);
    return all(min(over_low, under_high) > vec2f(-reach)) && reach - c.z > depths.x && -c.z - reach < depths.y;
}

// The part of the light from all around that a sphere leaves at a place of normal n, whose offset from the sphere's middle is
// -v: 1 - cos θ (r/d)², exact where all of it is above the horizon (Lambert's form factor of a sphere). One whose middle lies
// behind the tangent plane, as an object's own does, takes nothing. Full to 1/√2 of the reach.
fn left_by(v: vec3f, n: vec3f, radius: f32) -> f32 {
    let r2 = radius * radius;
    let d2 = dot(v, v);
    let d = max(sqrt(d2), radius);
    let fade = clamp(2.0 - 2.0 / (SPHERE_REACH * SPHERE_REACH) * d2 / r2, 0.0, 1.0);
    return 1.0 - max(dot(v, n), 0.0) * r2 / (d * d * d) * fade;
}
