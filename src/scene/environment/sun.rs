//! A sun in a picture of the surroundings, taken out as a light: a few texels that hold a large
//! share of all light are hardly ever met by a ray, which then shows as a spark, and a rasteriser
//! has shadow maps for lights only.

use super::EnvironmentImage;
use crate::scene::{Light, LightKind};
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// Half the angle around the brightest texel in which a sun is looked for, radians: four degrees,
/// sixteen times the sun's own radius, which holds the bright part of its aureole. What is as
/// bright over more than half of that is a window or a lamp, whose shape counts. A picture's texels
/// may be larger than the sun; their side is added to both.
const CONE: f64 = 0.07;

/// Times the mean of the rest up to which a texel of the cone stays in the picture. The whole cone
/// at that brightness adds less to one ray's standard deviation (`sqrt(cone / π)` · 10, 0.7) than
/// the mean that it is about.
const STAYS: f64 = 10.0;

/// A sun, and the picture without it. Together they send what the picture sent.
#[derive(Debug, Clone, PartialEq)]
pub struct SkySun {
    /// A directional light, from the middle of what was taken out, as wide and as bright as that.
    pub light: Light,
    /// The rest.
    pub rest: EnvironmentImage,
}

/// A texel's share of the sphere where the picture is read bilinearly: its solid angle, and the
/// mean direction times that, along +Y and away from that axis.
#[derive(Default)]
struct Row {
    solid_angle: f64,
    up: f64,
    across: f64,
}

fn luminance(p: &[f32]) -> f64 {
    0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2])
}

impl EnvironmentImage {
    /// Middle of a texel as a direction.
    fn direction(&self, x: usize, y: usize) -> DVec3 {
        let phi = TAU * ((x as f64 + 0.5) / f64::from(self.width) - 0.5);
        let theta = PI * (y as f64 + 0.5) / f64::from(self.height);
        DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
    }

    /// What a texel of row `y` stands for.
    fn row(&self, y: usize) -> Row {
        const POINTS: usize = 64;
        let side = PI / f64::from(self.height);
        let (middle, last) = (side * (y as f64 + 0.5), y + 1 == self.height as usize);
        let mut row = Row::default();
        let step = 2.0 * side / POINTS as f64;
        for i in 0..POINTS {
            let theta = middle - side + step * (i as f64 + 0.5);
            if !(0.0..=PI).contains(&theta) {
                continue;
            }
            // Held from the middles of the first row and of the last on to the poles.
            let held = (y == 0 && theta < middle) || (last && theta > middle);
            let weight = if held { 1.0 } else { 1.0 - (theta - middle).abs() / side };
            let share = weight * theta.sin() * step * TAU / f64::from(self.width);
            row.solid_angle += share;
            row.up += share * theta.cos();
            row.across += share * theta.sin();
        }
        let turn = TAU / f64::from(self.width);
        row.across *= 2.0 * (1.0 - turn.cos()) / (turn * turn);
        row
    }

    /// The sun, if the picture has one: a small place far brighter than the rest, which makes the
    /// light that single rays find vary by more than the mean of all other light.
    pub fn sun(&self) -> Option<SkySun> {
        let (width, height) = (self.width as usize, self.height as usize);
        let texels = |y: usize| &self.rgb[3 * y * width..3 * (y + 1) * width];
        let brightest = |y: usize| {
            let all = texels(y).chunks_exact(3).map(luminance).enumerate();
            all.fold((0.0, 0, y), |most, (x, l)| if l > most.0 { (l, x, y) } else { most })
        };
        let (peak, x, y) = (0..height).map(brightest).fold((0.0, 0, 0), |a, b| if b.0 > a.0 { b } else { a });
        let middle = self.direction(x, y);
        let texel = PI / f64::from(self.height);
        let (cone, widest) = (CONE + texel, 0.5 * CONE + texel);
        // Rows that reach into the cone.
        let reach = (cone / texel).ceil() as usize + 1;
        let rows = y.saturating_sub(reach)..(y + reach + 1).min(height);
        let inside = |x: usize, y: usize| self.direction(x, y).dot(middle) > cone.cos();

        let (mut sum, mut weight) = (0.0, 0.0);
        for y in 0..height {
            let counts = |x: &usize| !rows.contains(&y) || !inside(*x, y);
            let kept = (0..width).filter(counts);
            let (light, count) = kept.fold((0.0, 0), |(l, n), x| (l + luminance(&texels(y)[3 * x..]), n + 1));
            let angle = self.row(y).solid_angle;
            sum += light * angle;
            weight += f64::from(count) * angle;
        }
        let mean = if weight > 0.0 { sum / weight } else { 0.0 };
        let most = STAYS * mean;
        if peak <= most {
            return None;
        }

        // Irradiance of each colour as a vector, so that every surface that sees all of it gets the
        // same from the light.
        let (mut vectors, mut turned, mut covered) = ([DVec3::ZERO; 3], 0.0, 0.0);
        let mut rest = self.rgb.clone();
        for y in rows {
            let share = self.row(y);
            for x in (0..width).filter(|&x| inside(x, y)) {
                let at = 3 * (y * width + x);
                let l = luminance(&self.rgb[at..at + 3]);
                if l <= most {
                    continue;
                }
                let direction = self.direction(x, y);
                let flat = DVec3::new(direction.x, 0.0, direction.z).normalize_or_zero();
                let vector = flat * share.across + DVec3::Y * share.up;
                covered += share.solid_angle;
                for c in 0..3 {
                    let old = self.rgb[at + c];
                    rest[at + c] = (f64::from(old) * most / l) as f32;
                    vectors[c] += vector * f64::from(old - rest[at + c]);
                }
                turned += (l - most) * share.solid_angle * direction.angle_between(middle).powi(2);
            }
        }
        let total = vectors[0] * 0.2126 + vectors[1] * 0.7152 + vectors[2] * 0.0722;
        let (towards, irradiance) = (total.normalize_or(middle), total.length());
        // Second moment about the middle of the light; bilinear reading spreads each texel by a
        // third of its side's square more.
        let off = towards.angle_between(middle);
        let spread = (turned / irradiance - off * off).max(0.0) + texel * texel / 3.0;
        // A disc of radius r has the moment r²/2.
        let radius = (2.0 * spread).sqrt();
        let noise = irradiance * (PI / covered).sqrt();
        if radius > widest || noise < PI * mean {
            return None;
        }
        let color = vectors.map(|v| v.dot(towards).max(0.0));
        let strongest = color.iter().copied().fold(0.0, f64::max);
        let light = Light {
            name: format!("sun of {}", self.name),
            color: color.map(|c| (c / strongest) as f32),
            kind: LightKind::Directional {
                direction: (-towards).as_vec3().normalize_or(Vec3::NEG_Y).to_array(),
                irradiance: strongest as f32,
                angle: 2.0 * radius as f32,
            },
            is_emissive_proxy: false,
        };
        Some(SkySun { light, rest: Self { rgb: rest, ..self.clone_empty() } })
    }

    /// Name and size alone.
    fn clone_empty(&self) -> Self {
        Self { name: self.name.clone(), width: self.width, height: self.height, rgb: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sky that darkens towards the ground, with a disc of `radius` radians and `brightness` in
    /// it, by 8×8 points a texel.
    fn sky(width: u32, radius: f64, brightness: f32, towards: DVec3) -> EnvironmentImage {
        let mut image = EnvironmentImage { name: "sky".into(), width, height: width / 2, rgb: Vec::new() };
        let towards = towards.normalize();
        for y in 0..image.height as usize {
            for x in 0..width as usize {
                let d = image.direction(x, y);
                let mut share = 0.0;
                if d.angle_between(towards) < radius + 8.0 / f64::from(width) {
                    for k in 0..64 {
                        let [u, v] = [k % 8, k / 8].map(|i| (f64::from(i) + 0.5) / 8.0);
                        let phi = TAU * ((x as f64 + u) / f64::from(width) - 0.5);
                        let theta = PI * (y as f64 + v) / f64::from(image.height);
                        let d = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
                        share += if d.angle_between(towards) < radius { 1.0 / 64.0 } else { 0.0 };
                    }
                }
                let sky = (0.4 + 0.3 * d.y) as f32;
                let sun = brightness * share;
                image.rgb.extend([0.6 * sky + sun, 0.8 * sky + 0.9 * sun, sky + 0.7 * sun]);
            }
        }
        image
    }

    /// Irradiance on a surface that faces n, by nine points a texel, read as the shaders do.
    fn irradiance(image: &EnvironmentImage, n: Vec3) -> [f64; 3] {
        let (w, h) = (3 * image.width as usize, 3 * image.height as usize);
        let fine = EnvironmentImage { width: w as u32, height: h as u32, ..image.clone_empty() };
        let edge = |y: usize| (PI * y as f64 / h as f64).cos();
        let mut sum = [0.0; 3];
        for y in 0..h {
            for x in 0..w {
                let d = fine.direction(x, y).as_vec3();
                let weight = (edge(y) - edge(y + 1)) * TAU / w as f64 * f64::from(n.dot(d).max(0.0));
                if weight > 0.0 {
                    let radiance = image.radiance(d.to_array());
                    (0..3).for_each(|c| sum[c] += weight * f64::from(radiance[c]));
                }
            }
        }
        sum
    }

    fn of_light(light: &Light, n: Vec3) -> [f64; 3] {
        let LightKind::Directional { direction, irradiance, .. } = light.kind else { panic!("a sun") };
        let cos = -n.dot(direction.into());
        light.color.map(|c| f64::from(c * irradiance * cos.max(0.0)))
    }

    #[test]
    fn picture_and_light_send_what_the_picture_sent() {
        for (width, radius, towards) in [
            (256, 0.0047, DVec3::new(0.4, 0.7, -0.2)),
            (256, 0.012, DVec3::new(-1.0, 0.25, 0.003)),
            (128, 0.02, DVec3::new(0.02, 1.0, 0.01)),
            (64, 0.012, DVec3::new(0.1, 0.5, 0.9)),
        ] {
            let image = sky(width, radius, 4000.0 * (0.012 / radius).powi(2) as f32, towards);
            let found = image.sun().expect("it has a sun");
            let LightKind::Directional { direction, irradiance: e, angle } = found.light.kind else { panic!("a sun") };
            let off = (-Vec3::from(direction).as_dvec3()).angle_between(towards.normalize());
            let texel = PI / f64::from(image.height);
            println!("{width} wide: {e} W/m², {:.2}° wide, {:.2}° off", angle.to_degrees(), off.to_degrees());
            // Half a texel's diagonal.
            assert!(off < 0.75 * texel, "{off}");
            let wide = (radius * radius + 2.0 * texel * texel / 3.0).sqrt();
            assert!((f64::from(angle) * 0.5 - wide).abs() < 0.6 * texel, "{angle} {wide}");
            for n in [Vec3::Y, Vec3::X, Vec3::new(0.5, 0.5, -0.7), Vec3::new(-0.6, 0.3, 0.5), Vec3::new(0.1, -0.4, 0.9)]
            {
                let n = n.normalize();
                let (whole, rest, sun) = (irradiance(&image, n), irradiance(&found.rest, n), of_light(&found.light, n));
                // A surface whose horizon cuts the sun in two has more of one or of the other.
                let cut = f64::from(n.dot(towards.normalize().as_vec3())).abs() < radius + 2.0 * texel;
                for c in 0..3 {
                    let sum = rest[c] + sun[c];
                    let off = (sum / whole[c] - 1.0).abs();
                    assert!(off < if cut { 0.05 } else { 0.01 }, "{n}, {c}: {sum} of {}", whole[c]);
                }
                // Negative control: without the sun much is missing where it shines.
                assert!(n != Vec3::Y || rest[1] < 0.9 * whole[1]);
            }
            assert!(found.rest.sun().is_none(), "there is one sun");
        }
    }

    #[test]
    fn what_is_no_sun_stays() {
        let even = sky(256, 0.01, 0.0, DVec3::Y);
        assert!(even.sun().is_none());
        // Faint, and wide: a lamp, and a window of 12°.
        assert!(sky(256, 0.01, 5.0, DVec3::X).sun().is_none());
        assert!(sky(256, 0.2, 100.0, DVec3::X).sun().is_none());
        let night = EnvironmentImage { rgb: vec![0.0; 3 * 64 * 32], width: 64, height: 32, name: "night".into() };
        assert!(night.sun().is_none());
        // Negative control: what is as bright and small is one; and a sun in the night is.
        assert!(sky(256, 0.02, 5000.0, DVec3::X).sun().is_some());
        let mut spark = night.clone();
        spark.rgb[3 * (10 * 64 + 7)] = 50.0;
        let found = spark.sun().expect("nothing else shines");
        assert!(found.rest.rgb.iter().all(|v| *v == 0.0) && found.light.color == [1.0, 0.0, 0.0]);
    }
}
