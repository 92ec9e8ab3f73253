//! A picture of the surroundings: its numbers, and the cells from which light samples choose.

use bouncelight::scene::environment::EnvironmentImage;

/// Cells of the table at most; finer pictures are chosen from in blocks, which costs noise and no
/// correctness.
const MOST: [usize; 2] = [512, 256];

/// Cells (columns, rows) of `image`'s table and the chance of each, row by row: the mean luminance
/// of the cell and of the texels that bilinear interpolation lets shine into it, times its solid
/// angle. `None` for a black picture.
pub(super) fn cells(image: &EnvironmentImage) -> Option<([u32; 2], Vec<f64>)> {
    let (width, height) = (image.width as usize, image.height as usize);
    let [columns, rows] = [width.min(MOST[0]), height.min(MOST[1])];
    let luminance = |x: usize, y: usize| {
        let p = &image.rgb[3 * (y * width + x)..][..3];
        0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2])
    };
    let mut chances = Vec::with_capacity(columns * rows);
    for j in 0..rows {
        let edge = |j: usize| (std::f64::consts::PI * j as f64 / rows as f64).cos();
        let (top, bottom) = (j * height / rows, ((j + 1) * height).div_ceil(rows));
        for i in 0..columns {
            let (left, right) = (i * width / columns, ((i + 1) * width).div_ceil(columns));
            let mut sum = 0.0;
            for y in top.saturating_sub(1)..(bottom + 1).min(height) {
                for x in left + width - 1..right + width + 1 {
                    sum += luminance(x % width, y);
                }
            }
            let count = ((bottom + 1).min(height) - top.saturating_sub(1)) * (right - left + 2);
            chances.push(sum / count as f64 * (edge(j) - edge(j + 1)));
        }
    }
    let total: f64 = chances.iter().sum();
    if total.is_nan() || total <= 0.0 {
        return None;
    }
    chances.iter_mut().for_each(|c| *c /= total);
    Some(([columns as u32, rows as u32], chances))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chances_cover_all_that_shines_and_nothing_far_from_it() {
        let (width, height) = (1024u32, 512u32);
        let mut rgb = vec![0.0; 3 * (width * height) as usize];
        // One texel at the left edge, which shines across the seam as well.
        let lit = 3 * (200 * width) as usize;
        rgb[lit..lit + 3].fill(5.0);
        let image = EnvironmentImage { name: "spark".into(), width, height, rgb };
        let ([columns, rows], chances) = cells(&image).expect("it shines");
        assert_eq!([columns, rows], [512, 256]);
        assert!((chances.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let at = |x: usize, y: usize| chances[y * 512 + x];
        assert!(at(0, 100) > 0.0 && at(511, 100) > 0.0 && at(0, 99) > 0.0);
        assert!(at(2, 100) == 0.0 && at(0, 102) == 0.0 && at(256, 128) == 0.0);
        assert!(cells(&EnvironmentImage { rgb: vec![0.0; 24], width: 4, height: 2, name: "night".into() }).is_none());
    }
}
