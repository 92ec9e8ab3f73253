//! The materials of a home: reflectances of real things. Flat colours only: the light that a
//! network learns, E/π, has the surface's own colour divided out, so a texture would change nothing
//! of it but the little that it reflects.

use super::builder::Builder;
use super::plan::Kind;

/// Indices of materials that things share.
pub(super) struct Look {
    /// Of furniture.
    pub wood: [usize; 3],
    /// Of cupboards' fronts.
    pub front: usize,
    /// Of kitchens.
    pub top: usize,
    pub trim: usize,
    pub door: usize,
    pub white: usize,
    pub black: usize,
    pub metal: usize,
    /// Legs of tables and chairs: wood or metal.
    pub legs: usize,
    /// Cloth of furniture.
    pub fabric: [usize; 3],
    /// Cloth that hangs, seen from both sides.
    pub cloth: [usize; 2],
    pub linen: usize,
    pub covers: [usize; 6],
    /// Small things: some are glazed, some are metal.
    pub small: [usize; 6],
    pub leaf: usize,
    pub soil: usize,
    /// Of lamps, seen from both sides.
    pub shade: usize,
    /// Screens, at times lit.
    pub screen: usize,
}

impl Look {
    pub fn draw(b: &mut Builder, night: bool) -> Self {
        let mut wood = || {
            let (color, rough) = (b.timber(), b.between(0.35, 0.8));
            b.material("wood", color, rough)
        };
        let wood = [wood(), wood(), wood()];
        let trim = b.between(0.6, 0.84);
        let trim = b.material("trim", [trim, trim, 0.96 * trim], 0.5);
        let white = b.material("white", [0.8, 0.79, 0.77], 0.4);
        let black = b.material("black", [0.03; 3], 0.35);
        let metal = Self::a_metal(b);
        let fronts = [wood[0], white, Self::painted(b)];
        let stone = b.between(0.05, 0.6);
        let stone = b.material("stone", [stone; 3], 0.2);
        let fabric = std::array::from_fn(|_| {
            let dye = b.dye();
            b.material("fabric", dye, 0.95)
        });
        let cloth = std::array::from_fn(|_| {
            let dye = b.dye();
            b.sheet("cloth", dye, 0.95)
        });
        let covers = std::array::from_fn(|_| {
            let (dye, rough) = (b.dye(), b.between(0.4, 0.9));
            b.material("cover", dye, rough)
        });
        let small = std::array::from_fn(|_| match b.below(6) {
            0 => Self::a_metal(b),
            1 | 2 => {
                let dye = b.dye();
                b.material("glaze", dye, 0.15)
            }
            _ => Self::painted(b),
        });
        let (linen, green, shade) = (b.between(0.6, 0.85), b.between(0.12, 0.4), b.between(0.5, 0.8));
        let shade = if b.chance(0.8) { [shade, 0.95 * shade, 0.85 * shade] } else { b.dye() };
        let screen = b.between(0.3, 2.0);
        let radiance = b.hue(0.5, screen);
        let lit = night && b.chance(0.3);
        Self {
            wood,
            front: b.one_of(&fronts),
            top: b.one_of(&[stone, wood[1], white]),
            trim,
            door: b.one_of(&[trim, trim, wood[2]]),
            white,
            black,
            metal,
            legs: b.one_of(&[wood[0], wood[0], wood[1], metal, black]),
            fabric,
            cloth,
            linen: b.material("linen", [linen; 3], 0.95),
            covers,
            small,
            leaf: b.sheet("leaf", [0.35 * green, green, 0.2 * green], 0.5),
            soil: b.material("soil", [0.05, 0.035, 0.02], 1.0),
            shade: b.sheet("shade", shade, 0.9),
            screen: if lit { b.glow("lit screen", radiance) } else { b.material("screen", [0.02; 3], 0.12) },
        }
    }

    /// Steel, brass or copper, polished or brushed.
    fn a_metal(b: &mut Builder) -> usize {
        let color = b.one_of(&[[0.56, 0.57, 0.58], [0.56, 0.57, 0.58], [0.9, 0.66, 0.34], [0.93, 0.6, 0.48]]);
        let rough = b.between(0.12, 0.5);
        b.metal("metal", color, rough)
    }

    fn painted(b: &mut Builder) -> usize {
        let (dye, rough) = (b.dye(), b.between(0.3, 0.7));
        b.material("painted", dye, rough)
    }

    /// A floor for a kind of room: boards, tiles or carpet.
    pub fn floor(&self, b: &mut Builder, kind: Kind) -> usize {
        let tiles = if kind == Kind::Kitchen { 0.6 } else { 0.15 };
        let which = b.numbers.next();
        if which < tiles {
            let (tone, rough) = (b.between(0.1, 0.7), b.between(0.1, 0.4));
            b.material("tiles", [tone, tone, 0.95 * tone], rough)
        } else if which < tiles + 0.2 && kind != Kind::Kitchen {
            let dye = b.dye();
            b.material("carpet", dye, 1.0)
        } else {
            let (color, rough) = (b.timber(), b.between(0.3, 0.6));
            b.material("boards", color, rough)
        }
    }
}
