//! What a ray needs to know of a triangle that it meets: colours averaged over it, 16 bytes. A ray
//! of light carries no detail, so textures are read once, when the scene is loaded, and a scene's
//! 4k pictures cost the rays nothing.

use super::image::{Reduced, Reductions};
use crate::scene::{AlphaMode, Material, Mesh, Sampler, Scene, TextureRef};
use glam::{Vec2, Vec3};
use std::sync::LazyLock;

/// `Surface` of `shaders/accel/surface.wgsl`, packed: diffuse base colour and roughness,
/// reflectance at normal incidence and flags, emitted radiance, what a light sample's choice of it
/// goes by.
pub type Packed = [u32; 4];

/// Glows on both of its sides, and is drawn from both.
pub const DOUBLE_SIDED: u32 = 1;
/// Shows its colour to the camera, and takes and sends no light.
pub const UNLIT: u32 = 2;

/// Points of a triangle at which its textures are read, first the middle.
const POINTS: [[f32; 2]; 7] =
    [[0.3333, 0.3333], [0.1, 0.1], [0.8, 0.1], [0.1, 0.8], [0.45, 0.1], [0.1, 0.45], [0.45, 0.45]];

/// A triangle that covers more texels of the reduced picture than this is read at more points.
const FEW_TEXELS: f32 = 16.0;

/// Points of such a triangle.
static FINE: LazyLock<Vec<[f32; 2]>> = LazyLock::new(|| lattice(12));

/// The middles of the parts into which a triangle falls whose sides have so many: weights of the
/// second and third corner, row after row.
pub fn lattice(side: usize) -> Vec<[f32; 2]> {
    let row = |j: usize| {
        (0..2 * (side - j) - 1).map(move |k| {
            let third = (1 + k % 2) as f32 / 3.0;
            [k / 2, j].map(|n| (n as f32 + third) / side as f32)
        })
    };
    (0..side).flat_map(row).collect()
}

/// What is known of a triangle before it is packed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Base colour of the diffuse part, metals' share taken out.
    pub diffuse: Vec3,
    /// Reflectance at normal incidence.
    pub f0: Vec3,
    /// Perceptual roughness.
    pub roughness: f32,
    /// Emitted radiance, W/(m²·sr).
    pub emission: Vec3,
    /// Share of rays that it stops.
    pub coverage: f32,
    /// [`DOUBLE_SIDED`] and [`UNLIT`].
    pub flags: u32,
}

impl Surface {
    /// What the shader reads; colours by their square roots in 8 bits, emission with 9 bits a
    /// channel and one exponent.
    pub fn packed(&self) -> Packed {
        let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u32;
        let root = |c: Vec3| byte(c.x.sqrt()) | byte(c.y.sqrt()) << 8 | byte(c.z.sqrt()) << 16;
        [
            root(self.diffuse) | byte(self.roughness) << 24,
            root(self.f0) | self.flags << 24,
            shared_exponent(self.emission),
            self.glow_by_area().to_bits(),
        ]
    }

    /// Radiance that reaches those who look at it, as the shader knows it: what lets a share of all
    /// rays through sends the rest.
    pub fn glow(&self) -> Vec3 {
        from_shared_exponent(shared_exponent(self.emission)) * ((255 - self.open()) as f32 / 255.0)
    }

    /// Luminance of that times sides, by which light samples choose among glowing triangles of one
    /// area.
    pub fn glow_by_area(&self) -> f32 {
        let sides = if self.flags & DOUBLE_SIDED != 0 { 2.0 } else { 1.0 };
        luminance(self.glow()) * sides
    }

    /// How many of 255 rays it lets through.
    pub fn open(&self) -> u32 {
        255 - (self.coverage.clamp(0.0, 1.0) * 255.0 + 0.5) as u32
    }
}

/// Red, green and blue with 9 bits each and one exponent of 5, as `Rgb9e5Ufloat` (Vulkan's
/// specification) has them.
pub fn shared_exponent(c: Vec3) -> u32 {
    let c = c.max(Vec3::ZERO).min(Vec3::splat(65408.0));
    let c = if c.is_finite() { c } else { Vec3::ZERO };
    let most = c.max_element();
    let mut exponent = (most.max(1e-9).log2().floor() as i32).max(-16) + 16;
    let scale = |e: i32| 2f32.powi(e - 24);
    if (most / scale(exponent) + 0.5).floor() >= 512.0 {
        exponent += 1;
    }
    let code = |v: f32| ((v / scale(exponent) + 0.5) as u32).min(511);
    code(c.x) | code(c.y) << 9 | code(c.z) << 18 | (exponent as u32) << 27
}

/// What [`shared_exponent`] made of a colour.
pub fn from_shared_exponent(code: u32) -> Vec3 {
    let scale = 2f32.powi((code >> 27) as i32 - 24);
    Vec3::new((code & 511) as f32, (code >> 9 & 511) as f32, (code >> 18 & 511) as f32) * scale
}

/// Luminance of Rec. 709.
pub fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// The triangles of `mesh`, which names a material that exists. Those with a vertex behind the
/// first `vertices` are pieces of one within which colours differ, and looked at closely.
pub fn of_mesh(scene: &Scene, mesh: &Mesh, vertices: usize, reductions: &Reductions) -> Vec<Surface> {
    let material = &scene.materials[mesh.material];
    let textures = Textures::new(material, reductions);
    let plain = textures.is_plain() && mesh.colors.is_empty();
    let same = plain.then(|| surface(material, &textures, mesh, [0; 3], false));
    let one = |t: &[u32]| {
        let corners = [t[0], t[1], t[2]].map(|i| i as usize);
        same.unwrap_or_else(|| surface(material, &textures, mesh, corners, corners.iter().any(|i| *i >= vertices)))
    };
    mesh.indices.chunks_exact(3).map(one).collect()
}

/// A material without pictures and vertex colours.
pub fn plain(material: &Material) -> Surface {
    let none = Textures { base: None, rough: None, glow: None };
    surface(material, &none, &Mesh::default(), [0; 3], false)
}

/// The pictures of a material, made small.
pub struct Textures<'a> {
    base: Option<&'a Reduced>,
    rough: Option<&'a Reduced>,
    /// What glows.
    pub glow: Option<&'a Reduced>,
}

impl<'a> Textures<'a> {
    /// Those that there are.
    pub fn new(material: &Material, reductions: &'a Reductions) -> Self {
        let find = |t, cutoff| Option::and_then(t, |t| reductions.find(&t, cutoff));
        Self {
            base: find(material.base_color_texture, super::image::cutoff(material)),
            rough: find(material.metallic_roughness_texture, None),
            glow: find(material.emissive_texture, None),
        }
    }

    /// Whether there are none.
    pub fn is_plain(&self) -> bool {
        self.base.is_none() && self.rough.is_none() && self.glow.is_none()
    }
}

/// A picture on a triangle: the texture coordinates of its corners.
struct Use<'a> {
    picture: &'a Reduced,
    sampler: Sampler,
    at: [Vec2; 3],
}

impl<'a> Use<'a> {
    fn new(
        picture: Option<&'a Reduced>,
        texture: Option<TextureRef>,
        mesh: &Mesh,
        corners: [usize; 3],
    ) -> Option<Self> {
        let (picture, texture) = (picture?, texture?);
        let from = if texture.uv_set == 0 { &mesh.uv0 } else { &mesh.uv1 };
        let at = corners.map(|i| {
            let p = from.get(i).copied().map_or(Vec2::ZERO, Vec2::from);
            let [u, v] = texture.transform.map(|r| r[0] * p.x + r[1] * p.y + r[2]);
            Vec2::new(u, v)
        });
        Some(Self { picture, sampler: texture.sampler, at })
    }

    /// As [`Places::at`]; white where there is no picture.
    #[inline(always)]
    fn read(this: &Option<Self>, weights: [f32; 3], share: f32) -> [f32; 4] {
        let Some(Use { picture, sampler, at }) = this else { return [1.0; 4] };
        let level = if share > 0.0 { picture.level_of(share * picture.texels_in(at)) } else { 0 };
        picture.read(at[0] * weights[0] + at[1] * weights[1] + at[2] * weights[2], sampler, level)
    }
}

/// What its material says of the places of a triangle.
pub struct Places<'a> {
    material: &'a Material,
    base: Option<Use<'a>>,
    rough: Option<Use<'a>>,
    glow: Option<Use<'a>>,
    colors: [[f32; 4]; 3],
}

/// What is known of a place of a triangle.
pub struct Place {
    /// Share of rays that it stops.
    pub alpha: f32,
    /// As of a [`Surface`].
    pub diffuse: Vec3,
    /// As of a [`Surface`].
    pub f0: Vec3,
    /// As of a [`Surface`].
    pub emission: Vec3,
    roughness: f32,
}

impl<'a> Places<'a> {
    /// Of the triangle with these corners.
    pub fn new(material: &'a Material, textures: &Textures<'a>, mesh: &Mesh, corners: [usize; 3]) -> Self {
        Self {
            material,
            base: Use::new(textures.base, material.base_color_texture, mesh, corners),
            rough: Use::new(textures.rough, material.metallic_roughness_texture, mesh, corners),
            glow: Use::new(textures.glow, material.emissive_texture, mesh, corners),
            colors: corners.map(|i| mesh.colors.get(i).copied().unwrap_or([1.0; 4])),
        }
    }

    /// Whether a picture may cut holes into it.
    pub fn is_cut_out(&self) -> bool {
        self.material.alpha_mode != AlphaMode::Opaque && self.base.is_some()
    }

    /// Texels that the triangle covers of the picture of which it covers most.
    fn texels(&self) -> f32 {
        let uses = [&self.base, &self.rough, &self.glow];
        uses.into_iter().flatten().map(|u| u.picture.texels_in(&u.at)).fold(0.0, f32::max)
    }

    /// What is at the place with these weights of the corners; of each picture the mean over
    /// `share` of the triangle around it, 0 for a texel. Inlined: called without, it doubles what a
    /// scene of leaves takes to load.
    #[inline(always)]
    pub fn at(&self, weights: [f32; 3], share: f32) -> Place {
        let m = self.material;
        let [a, b, c] = self.colors;
        let color = |k: usize| a[k] * weights[0] + b[k] * weights[1] + c[k] * weights[2];
        let base = Use::read(&self.base, weights, share);
        let factor = Vec3::new(m.base_color[0], m.base_color[1], m.base_color[2]);
        let rgb = Vec3::new(base[0], base[1], base[2]) * factor * Vec3::new(color(0), color(1), color(2));
        let rgb = rgb.clamp(Vec3::ZERO, Vec3::ONE);
        let alpha = match m.alpha_mode {
            AlphaMode::Opaque => 1.0,
            // The reduced picture's alpha is the share of texels above the cutoff, vertex colours
            // aside.
            AlphaMode::Mask { .. } if self.base.is_some() => base[3],
            AlphaMode::Mask { cutoff } => f32::from(u8::from(m.base_color[3] * color(3) >= cutoff)),
            AlphaMode::Blend => (base[3] * m.base_color[3] * color(3)).clamp(0.0, 1.0),
        };
        let rough = Use::read(&self.rough, weights, share);
        let metallic = (m.metallic * rough[2]).clamp(0.0, 1.0);
        let glow = Use::read(&self.glow, weights, share);
        Place {
            alpha,
            diffuse: rgb * (1.0 - metallic),
            f0: (m.f0 * Vec3::from(m.specular_tint)).lerp(rgb, metallic),
            emission: Vec3::from(m.emission()) * Vec3::new(glow[0], glow[1], glow[2]),
            roughness: (m.roughness * rough[1]).clamp(0.0, 1.0),
        }
    }
}

fn surface(m: &Material, textures: &Textures<'_>, mesh: &Mesh, corners: [usize; 3], closely: bool) -> Surface {
    let places = Places::new(m, textures, mesh, corners);
    let many = closely || places.texels() > FEW_TEXELS;
    let points: &[[f32; 2]] = if many { &FINE } else { &POINTS };
    let (mut diffuse, mut f0, mut emission) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
    let (mut roughness, mut coverage, mut weight) = (0.0, 0.0, 0.0);
    for [v, w] in points {
        let place = places.at([1.0 - v - w, *v, *w], 0.0);
        let counts = place.alpha.max(1e-3);
        weight += counts;
        coverage += place.alpha;
        diffuse += counts * place.diffuse;
        f0 += counts * place.f0;
        roughness += counts * place.roughness;
        emission += counts * place.emission;
    }
    let flags = (u32::from(m.double_sided) * DOUBLE_SIDED) | (u32::from(m.unlit) * UNLIT);
    let dark = if m.unlit { 0.0 } else { 1.0 / weight };
    Surface {
        diffuse: diffuse * dark,
        f0: f0 * dark,
        roughness: roughness / weight,
        emission: emission * dark,
        coverage: coverage / points.len() as f32,
        flags,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shared_exponents_keep_nine_bits() {
        for c in [
            [0.0, 0.0, 0.0],
            [1.0, 0.5, 0.25],
            [300.0, 2.0, 0.1],
            [1e-3, 2e-3, 3e-3],
            [65408.0, 1.0, 0.0],
            [511.9, 0.0, 1.0],
        ] {
            let back = from_shared_exponent(shared_exponent(c.into()));
            let most = Vec3::from(c).max_element();
            assert!((back - Vec3::from(c)).abs().max_element() <= most / 511.0 + 1e-8, "{c:?} {back}");
        }
        assert_eq!(shared_exponent(Vec3::NAN), shared_exponent(Vec3::ZERO));
        assert_eq!(from_shared_exponent(shared_exponent(Vec3::splat(-1.0))), Vec3::ZERO);
    }
}
