//! The path tracer's rays hit what they must: against brute force, against leaks, at odd places and
//! scales.

mod instances;
mod oracle;

use bouncelight::accel::{Accel, AccelError, HitGpu, MAX_TRIANGLES, RayGpu};
use oracle::*;

#[test]
fn nearest_hits_are_those_of_brute_force() {
    let bench = Bench::new();
    for (count, size) in [(1, 1.0), (2, 1.0), (9, 0.5), (300, 0.3), (3000, 0.05)] {
        let triangles = soup(count, size, count as u64);
        let accel = Accel::build(&triangles).unwrap();
        let rays = random_rays(2000, 1.5, 77);
        let cpu = on_cpu(&accel, &rays);
        assert_eq!(disagreements(&triangles, &rays, &cpu, 1.0), 0, "CPU, {count} triangles");
        if count > 2 {
            assert!(cpu.iter().filter(|h| h.triangle != NONE).count() > 20, "the rays hit something");
        }
        let Some(bench) = &bench else { continue };
        let hits = bench.trace(&accel, &rays);
        assert_eq!(disagreements(&triangles, &rays, &hits, 1.0), 0, "GPU, {count} triangles");
        // Negative control: without one triangle in ten the same check fails.
        if count >= 300 {
            let fewer: Vec<_> =
                triangles.iter().enumerate().map(|(i, t)| if i % 10 == 0 { [[9.0; 3]; 3] } else { *t }).collect();
            let worse = bench.trace(&Accel::build(&fewer).unwrap(), &rays);
            assert!(disagreements(&triangles, &rays, &worse, 1.0) > 10, "missing triangles are noticed");
        }
    }
}

#[test]
fn scale_and_place_do_not_matter() {
    let bench = Bench::new();
    for (scale, shift) in [(1e-5, 0.0), (1e6, 0.0), (1.0, 1000.0), (1e-3, 5.0)] {
        let place = |p: Point| p.map(|x| x * scale + shift);
        let triangles: Vec<Triangle> = soup(500, 0.3, 5).into_iter().map(|t| t.map(place)).collect();
        let rays: Vec<RayGpu> =
            random_rays(1000, 1.5, 6).into_iter().map(|r| RayGpu { origin: place(r.origin), ..r }).collect();
        let accel = Accel::build(&triangles).unwrap();
        let unit = f64::from(scale.max(shift.abs()));
        assert_eq!(
            disagreements(&triangles, &rays, &on_cpu(&accel, &rays), unit),
            0,
            "CPU at scale {scale}, shift {shift}"
        );
        let Some(bench) = &bench else { continue };
        let hits = bench.trace(&accel, &rays);
        assert_eq!(disagreements(&triangles, &rays, &hits, unit), 0, "GPU at scale {scale}, shift {shift}");
    }
}

/// A grid of axis-parallel quads: flat boxes, rays along axes, in planes and along borders of
/// boxes.
#[test]
fn rays_along_axes_and_from_surfaces() {
    let mut triangles: Vec<Triangle> = Vec::new();
    for axis in 0..3 {
        for level in [-1.0f32, 0.0, 1.0] {
            for cell in 0..64 {
                let (i, j) = ((cell % 8) as f32 / 4.0 - 1.0, (cell / 8) as f32 / 4.0 - 1.0);
                let at = |u: f32, v: f32| -> Point {
                    let mut p = [level; 3];
                    (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (i + u, j + v);
                    p
                };
                triangles.push([at(0.0, 0.0), at(0.25, 0.0), at(0.25, 0.25)]);
                triangles.push([at(0.0, 0.0), at(0.25, 0.25), at(0.0, 0.25)]);
            }
        }
    }
    let accel = Accel::build(&triangles).unwrap();
    let mut random = Random(8);
    let mut rays = Vec::new();
    for i in 0..3000 {
        let axis = i % 3;
        let mut direction = [0.0; 3];
        direction[axis] = if i % 2 == 0 { 1.0 } else { -1.0 };
        // Some start exactly on a surface, some have exact coordinates of edges.
        let snap = |x: f32| if i % 5 == 0 { (x * 4.0).round() / 4.0 } else { x };
        let mut origin = random.point().map(|x| snap(x * 0.99));
        if i % 7 == 0 {
            origin[axis] = 0.0;
        }
        rays.push(ray(origin, direction));
    }
    let check = |name: &str, hits: &[HitGpu]| {
        for (ray, hit) in rays.iter().zip(hits) {
            let axis = ray.direction.iter().position(|d| *d != 0.0).unwrap();
            let (x, d) = (ray.origin[axis], ray.direction[axis]);
            // The surface a ray starts on does not count, the next one does.
            let expected = [-1.0f32, 0.0, 1.0]
                .iter()
                .map(|level| (level - x) * d)
                .filter(|t| *t > 0.0)
                .fold(f32::INFINITY, f32::min);
            if expected.is_finite() {
                assert!((hit.t - expected).abs() <= 1e-6, "{name}: {ray:?} gave {hit:?}, not {expected}");
            } else {
                assert_eq!(hit.triangle, NONE, "{name}: {ray:?} gave {hit:?}");
            }
        }
    };
    check("CPU", &on_cpu(&accel, &rays));
    let Some(bench) = Bench::new() else { return };
    check("GPU", &bench.trace(&accel, &rays));
}

/// Rays from inside a closed sphere: aimed anywhere, at corners and at edges.
fn rays_in_a_sphere(triangles: &[Triangle], count: usize) -> Vec<RayGpu> {
    let mut random = Random(11);
    let mut one = |i: usize| {
        let origin = random.point().map(|x| x * 0.5);
        let triangle = triangles[random.bits() as usize % triangles.len()];
        let share = 0.5 * (random.signed() + 1.0);
        let target = match i % 3 {
            0 => return ray(origin, random.direction()),
            1 => triangle[i / 3 % 3],
            _ => std::array::from_fn(|k| triangle[0][k] + (triangle[1][k] - triangle[0][k]) * share),
        };
        ray(origin, std::array::from_fn(|k| target[k] - origin[k]))
    };
    (0..count).map(&mut one).collect()
}

#[test]
fn no_ray_leaves_a_closed_sphere() {
    let triangles = sphere(48);
    let rays = rays_in_a_sphere(&triangles, 150_000);
    let leaks = |hits: &[HitGpu]| hits.iter().filter(|h| h.triangle == NONE).count();
    let whole = Accel::build(&triangles).unwrap();
    // Negative control: one triangle less.
    let open = Accel::build(&triangles[1..]).unwrap();
    assert_eq!(leaks(&on_cpu(&whole, &rays)), 0);
    assert!(leaks(&on_cpu(&open, &rays)) > 0);
    let Some(bench) = Bench::new() else { return };
    assert_eq!(leaks(&bench.trace(&whole, &rays)), 0);
    assert!(leaks(&bench.trace(&open, &rays)) > 0);
}

#[test]
fn any_hit_agrees_with_the_nearest() {
    let Some(bench) = Bench::new() else { return };
    let accel = Accel::build(&soup(2000, 0.1, 3)).unwrap();
    let nearest = random_rays(5000, 1.0, 4);
    let mut shadow = nearest.clone();
    for (i, ray) in shadow.iter_mut().enumerate() {
        ray.any = 1;
        ray.t_max = 0.1 * (i % 10 + 1) as f32;
    }
    let (a, b) = (bench.trace(&accel, &nearest), bench.trace(&accel, &shadow));
    let mut blocked = 0;
    for ((near, any), ray) in a.iter().zip(&b).zip(&shadow) {
        assert_eq!(any.triangle != NONE, near.t < ray.t_max, "{ray:?}: nearest {near:?}, any {any:?}");
        assert!(any.triangle == NONE || any.t < ray.t_max);
        blocked += usize::from(any.triangle != NONE);
    }
    assert!(blocked > 200 && blocked < 4800, "{blocked} of 5000 blocked");
}

/// Barycentric weights give the point that the distance gives, for single triangles and for those
/// that share a leaf.
#[test]
fn weights_and_distance_name_the_same_point() {
    let bench = Bench::new();
    for triangles in [soup(500, 0.4, 21), sphere(24)] {
        let accel = Accel::build(&triangles).unwrap();
        let rays = random_rays(3000, 1.2, 22);
        let mut all = on_cpu(&accel, &rays);
        all.extend(bench.iter().flat_map(|b| b.trace(&accel, &rays)));
        let mut seen = 0;
        for (ray, hit) in rays.iter().cycle().zip(&all) {
            let Some([a, b, c]) = triangles.get(hit.triangle as usize) else { continue };
            let [v, w] = hit.uv;
            for k in 0..3 {
                let p = a[k] * (1.0 - v - w) + b[k] * v + c[k] * w;
                let q = ray.origin[k] + hit.t * ray.direction[k];
                assert!((p - q).abs() < 2e-5, "{ray:?} {hit:?}: {p} is not {q}");
            }
            seen += 1;
        }
        assert!(seen > all.len() / 6, "{seen} hits of {}", all.len());
    }
}

/// Negative control: a tree with one plane of one box in the wrong place is noticed.
#[test]
fn a_damaged_tree_is_noticed() {
    let triangles = soup(300, 0.3, 9);
    let mut accel = Accel::build(&triangles).unwrap();
    let rays = random_rays(2000, 1.2, 10);
    assert_eq!(disagreements(&triangles, &rays, &on_cpu(&accel, &rays), 1.0), 0);
    // The root's first four high planes along y become low ones.
    accel.words_mut()[10] = 0;
    assert!(disagreements(&triangles, &rays, &on_cpu(&accel, &rays), 1.0) > 0);
    let Some(bench) = Bench::new() else { return };
    assert!(disagreements(&triangles, &rays, &bench.trace(&accel, &rays), 1.0) > 0);
}

/// Blocks visited grow by about as much from 1,000 to 10,000 triangles as from there to 100,000.
#[test]
fn visits_grow_like_a_logarithm() {
    let visits = [16usize, 50, 158].map(|n| {
        let accel = Accel::build(&sphere(n)).unwrap();
        let rays = random_rays(2000, 0.9, 33);
        let sum: usize = rays.iter().map(|r| accel.visits(r.origin, r.direction, r.t_max)).sum();
        (accel.triangle_count(), sum as f64 / rays.len() as f64)
    });
    println!("{visits:?}");
    let [a, b, c] = visits.map(|v| v.1);
    assert!(b - a > 0.5 && c - b < 1.6 * (b - a) && c < 2.0 * a, "{visits:?}");
}

/// Nearly every triangle of a mesh finds a partner to share a leaf with; strewn ones find none.
#[test]
fn neighbours_share_leaves() {
    let (mut mesh, mut strewn) = (Accel::build(&sphere(48)).unwrap(), Accel::build(&soup(1000, 0.1, 1)).unwrap());
    // What fills its box badly stands in several leaves.
    let kinds = |accel: &mut Accel| {
        let leaves = accel.words_mut().chunks(16).filter(|b| b[3] == 0 && b[..15].iter().any(|w| *w != 0));
        leaves.collect::<std::collections::HashSet<_>>().len()
    };
    let leaves = kinds(&mut mesh);
    assert!(leaves * 100 < mesh.triangle_count() * 53, "{leaves} leaves");
    assert_eq!(kinds(&mut strewn), 1000);
    assert!(strewn.leaf_count() <= 1200, "{} leaves", strewn.leaf_count());
}

#[test]
fn bad_triangles_are_left_out_and_counted() {
    let mut triangles = soup(100, 0.3, 1);
    triangles[3][1][2] = f32::NAN;
    triangles[4][0][0] = f32::INFINITY;
    triangles[5][2][1] = 1e20;
    triangles[6] = [[0.5; 3]; 3];
    triangles[7] = [[0.0; 3], [1.0, 0.0, 0.0], [0.25, 0.0, 0.0]];
    let accel = Accel::build(&triangles).unwrap();
    assert_eq!((accel.dropped_not_finite, accel.dropped_degenerate, accel.triangle_count()), (3, 2, 95));
    let rays = random_rays(500, 1.0, 2);
    triangles[3..8].fill([[9.0; 3]; 3]);
    assert_eq!(disagreements(&triangles, &rays, &on_cpu(&accel, &rays), 1.0), 0);
    // Needles, which are nearly degenerate, neither break the tree nor give anything but finite
    // hits.
    let needles: Vec<Triangle> =
        (0..200).map(|i| [[0.0; 3], [1.0, i as f32 * 1e-7, 0.0], [1.0, i as f32 * 1e-7, 1e-7]]).collect();
    let accel = Accel::build(&needles).unwrap();
    assert!(on_cpu(&accel, &rays).iter().all(|h| h.triangle == NONE || h.t.is_finite()));
}

#[test]
fn nothing_is_hit_where_nothing_is() {
    let empty = Accel::build(&[]).unwrap();
    assert_eq!((empty.triangle_count(), empty.block_count()), (0, 1));
    let rays = random_rays(100, 1.0, 2);
    assert!(on_cpu(&empty, &rays).iter().all(|h| h.triangle == NONE));
    let Some(bench) = Bench::new() else { return };
    assert!(bench.trace(&empty, &rays).iter().all(|h| h.triangle == NONE));
    // Rays that are no rays end, too.
    let odd = [
        ray([f32::NAN; 3], [1.0, 0.0, 0.0]),
        ray([0.0; 3], [0.0; 3]),
        ray([0.0; 3], [f32::NAN; 3]),
        ray([f32::INFINITY; 3], [1.0; 3]),
    ];
    assert!(bench.trace(&Accel::build(&soup(100, 0.5, 1)).unwrap(), &odd).iter().all(|h| h.triangle == NONE));
}

#[test]
fn too_many_triangles_are_refused_with_the_number() {
    let error = Accel::check_count(1_000_000 * 12).unwrap_err();
    assert!(matches!(error, AccelError::TooManyTriangles { triangles: 12_000_000 }));
    let text = error.to_string();
    assert!(text.contains("12000000") && text.contains(&MAX_TRIANGLES.to_string()), "{text}");
    assert!(Accel::check_count(MAX_TRIANGLES).is_ok());
}

/// Triangles nested in one another by powers of two, and a thousand in one place: the tree stays
/// within the stack.
#[test]
fn the_tree_is_never_deeper_than_the_stack() {
    let nested: Vec<Triangle> = (-38..38)
        .map(|e| {
            let s = 2f32.powi(e);
            [[0.0, 0.0, s], [s, 0.0, s], [0.0, s, s]]
        })
        .collect();
    let alike = vec![[[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]]; 1000];
    for triangles in [nested, alike] {
        let accel = Accel::build(&triangles).unwrap();
        assert!(accel.depth() <= bouncelight::accel::STACK_SIZE, "{} levels", accel.depth());
        let hit = accel.closest([0.1e-13, 0.1e-13, 0.0], [0.0, 0.0, 1.0], f32::INFINITY).expect("they are in the way");
        assert!(hit.t > 0.0);
    }
}
