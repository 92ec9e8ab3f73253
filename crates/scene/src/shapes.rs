//! Blender's default mesh primitives with flat normals, in our Y-up coordinates.
//!
//! Vertex positions are those of Blender 4.5's `mesh.primitive_*_add` without arguments, (x, y, z)
//! → (x, z, −y). Faces share no vertices, so each has its own normal; polygons are cut into fans
//! from their first corner.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use bouncelight::scene::Mesh;

/// One of the six primitives, in the order of the paper's recipe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Edge 2.
    Cube,
    /// 32 sides, radius 1, depth 2.
    Cylinder,
    /// 32 sides, radius 1, depth 2.
    Cone,
    /// 32 segments, 16 rings, radius 1.
    UvSphere,
    /// 2 subdivisions (80 faces), radius 1.
    IcoSphere,
    /// Radii 1 and 0.25, 48 by 12 segments.
    Torus,
}

impl Shape {
    /// All of them, in the order of the recipe.
    pub const ALL: [Shape; 6] =
        [Shape::Cube, Shape::Cylinder, Shape::Cone, Shape::UvSphere, Shape::IcoSphere, Shape::Torus];

    /// The name that Blender's operators use.
    pub fn name(self) -> &'static str {
        ["cube", "cylinder", "cone", "uv_sphere", "ico_sphere", "torus"][self as usize]
    }
}

/// The primitive as a flat-shaded mesh with material 0.
pub fn flat(shape: Shape) -> Mesh {
    let polygons = match shape {
        Shape::Cube => cube(),
        Shape::Cylinder => cylinder(),
        Shape::Cone => cone(),
        Shape::UvSphere => uv_sphere(),
        Shape::IcoSphere => ico_sphere(),
        Shape::Torus => torus(),
    };
    let mut mesh = Mesh { name: shape.name().to_owned(), ..Mesh::default() };
    for polygon in polygons {
        push_polygon(&mut mesh, &polygon);
    }
    mesh
}

type Polygon = Vec<DVec3>;

/// Adds one planar convex polygon, given in Blender's coordinates, counter-clockwise from outside.
fn push_polygon(mesh: &mut Mesh, polygon: &[DVec3]) {
    // Newell's sum: right for any planar polygon, also where the first corner is a flat one.
    let normal: DVec3 = (0..polygon.len()).map(|i| polygon[i].cross(polygon[(i + 1) % polygon.len()])).sum();
    let normal = y_up(normal.normalize());
    let first = mesh.positions.len() as u32;
    for &corner in polygon {
        mesh.positions.push(y_up(corner).into());
        mesh.normals.push(normal.into());
    }
    for i in 1..polygon.len() as u32 - 1 {
        mesh.indices.extend([first, first + i, first + i + 1]);
    }
}

fn y_up(v: DVec3) -> Vec3 {
    DVec3::new(v.x, v.z, -v.y).as_vec3()
}

/// Turns the polygons of a convex body around its origin so that they face outwards.
fn outwards(mut polygons: Vec<Polygon>) -> Vec<Polygon> {
    for polygon in &mut polygons {
        let normal: DVec3 = (0..polygon.len()).map(|i| polygon[i].cross(polygon[(i + 1) % polygon.len()])).sum();
        if normal.dot(polygon.iter().sum()) < 0.0 {
            polygon.reverse();
        }
    }
    polygons
}

fn cube() -> Vec<Polygon> {
    let mut faces = Vec::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            faces.push(
                corners
                    .iter()
                    .map(|&(a, b)| {
                        let mut p = [side; 3];
                        (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (a, b);
                        DVec3::from(p)
                    })
                    .collect(),
            );
        }
    }
    outwards(faces)
}

/// Blender's circle starts at +Y and turns towards +X.
fn circle(i: usize, n: usize, z: f64) -> DVec3 {
    let (sin, cos) = (TAU * i as f64 / n as f64).sin_cos();
    DVec3::new(sin, cos, z)
}

fn cylinder() -> Vec<Polygon> {
    let ring = |z: f64| (0..32).map(|i| circle(i, 32, z)).collect::<Polygon>();
    let mut faces = vec![ring(-1.0), ring(1.0)];
    faces.extend(
        (0..32).map(|i| vec![circle(i, 32, -1.0), circle(i + 1, 32, -1.0), circle(i + 1, 32, 1.0), circle(i, 32, 1.0)]),
    );
    outwards(faces)
}

fn cone() -> Vec<Polygon> {
    let mut faces = vec![(0..32).map(|i| circle(i, 32, -1.0)).collect::<Polygon>()];
    faces.extend((0..32).map(|i| vec![circle(i, 32, -1.0), circle(i + 1, 32, -1.0), DVec3::Z]));
    outwards(faces)
}

fn uv_sphere() -> Vec<Polygon> {
    let point = |ring: usize, segment: usize| {
        let (sin, cos) = (TAU * ring as f64 / 32.0).sin_cos();
        (circle(segment, 32, 0.0) * sin).with_z(cos)
    };
    let mut faces = Vec::new();
    for s in 0..32 {
        faces.push(vec![DVec3::Z, point(1, s), point(1, s + 1)]);
        faces.push(vec![DVec3::NEG_Z, point(15, s), point(15, s + 1)]);
        for r in 1..15 {
            faces.push(vec![point(r, s), point(r + 1, s), point(r + 1, s + 1), point(r, s + 1)]);
        }
    }
    outwards(faces)
}

fn ico_sphere() -> Vec<Polygon> {
    // Blender's table of the twelve corners, in two-hundredths of the radius; it is rounded and
    // normalised again.
    let upper = [[55.277, -170.128], [-144.72, -105.144], [-144.72, 105.144], [55.277, 170.128], [178.885, 0.0]];
    let mut corners = vec![DVec3::Z, DVec3::NEG_Z];
    for [x, y] in upper {
        corners.push(DVec3::new(x, y, 89.443).normalize());
        corners.push(DVec3::new(-x, -y, -89.443).normalize());
    }
    let near = |a: DVec3, b: DVec3| a.distance(b) < 1.2;
    let mut faces = Vec::new();
    for (i, &a) in corners.iter().enumerate() {
        for (j, &b) in corners.iter().enumerate().skip(i + 1) {
            for &c in corners.iter().skip(j + 1).filter(|&&c| near(a, b) && near(b, c) && near(c, a)) {
                let (ab, bc, ca) = ((a + b).normalize(), (b + c).normalize(), (c + a).normalize());
                faces.extend([vec![a, ab, ca], vec![b, bc, ab], vec![c, ca, bc], vec![ab, bc, ca]]);
            }
        }
    }
    outwards(faces)
}

fn torus() -> Vec<Polygon> {
    let point = |major: usize, minor: usize| {
        let (sin_a, cos_a) = (TAU * major as f64 / 48.0).sin_cos();
        let (sin_b, cos_b) = (TAU * minor as f64 / 12.0).sin_cos();
        let radius = 1.0 + 0.25 * cos_b;
        DVec3::new(cos_a * radius, sin_a * radius, 0.25 * sin_b)
    };
    let quad = |a: usize, b: usize| vec![point(a, b), point(a + 1, b), point(a + 1, b + 1), point(a, b + 1)];
    (0..48).flat_map(|a| (0..12).map(move |b| quad(a, b))).collect()
}
