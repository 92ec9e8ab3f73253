//! Vertices and faces of an OBJ file to meshes: one a run of faces of one group and one material.

use super::polygon::Cutter;
use crate::geometry;
use bouncelight::scene::Mesh;
use glam::Vec3;

/// No index: a corner without that attribute, the end of a chain.
const NONE: u32 = u32::MAX;

/// How many vertices at one position are looked through for an equal one.
const LONGEST: usize = 64;

/// A corner's place, texture coordinates and normal, as indices into the file's lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Corner {
    place: u32,
    uv: u32,
    normal: u32,
}

/// Faces that become one mesh.
struct Run {
    name: String,
    /// Number of the material's name.
    material: Option<usize>,
    vertices: Vec<Corner>,
    /// The next vertex at the same place, one a vertex.
    next: Vec<u32>,
    indices: Vec<u32>,
}

/// A mesh, and the number of its material's name.
pub(super) struct Made {
    pub(super) mesh: Mesh,
    pub(super) material: Option<usize>,
}

/// What has been read so far.
pub(super) struct Faces {
    places: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    /// Colour of each place, NaN where it has none; shorter where no later one has any.
    colors: Vec<[f32; 3]>,
    /// Number of the run that used a place last, and its first vertex there.
    used: Vec<(u32, u32)>,
    run: Run,
    runs: u32,
    pub(super) made: Vec<Made>,
    corners: Vec<Corner>,
    polygon: Vec<[f32; 3]>,
    pub(super) cutter: Cutter,
    triangles: Vec<[usize; 3]>,
    /// Faces with less than three corners.
    pub(super) thin: usize,
}

impl Faces {
    pub(super) fn new() -> Self {
        Self {
            places: Vec::new(),
            uvs: Vec::new(),
            normals: Vec::new(),
            colors: Vec::new(),
            used: Vec::new(),
            run: Run::new("unnamed_object".to_owned(), None),
            runs: 1,
            made: Vec::new(),
            corners: Vec::new(),
            polygon: Vec::new(),
            cutter: Cutter::default(),
            triangles: Vec::new(),
            thin: 0,
        }
    }

    /// A vertex, with its colour if it has one.
    pub(super) fn place(&mut self, place: [f32; 3], color: Option<[f32; 3]>) {
        if let Some(color) = color {
            self.colors.resize(self.places.len(), [f32::NAN; 3]);
            self.colors.push(color);
        }
        self.places.push(place);
        self.used.push((0, NONE));
    }

    pub(super) fn uv(&mut self, uv: [f32; 2]) {
        self.uvs.push(uv);
    }

    pub(super) fn normal(&mut self, normal: [f32; 3]) {
        self.normals.push(normal);
    }

    /// Begins an object or group.
    pub(super) fn group(&mut self, name: &str) {
        let name = if name.is_empty() { "unnamed_object" } else { name };
        self.begin(name.to_owned(), self.run.material);
    }

    /// Faces have this material from here on.
    pub(super) fn material(&mut self, material: usize) {
        if self.run.material != Some(material) {
            let name = self.run.name.clone();
            self.begin(name, Some(material));
        }
    }

    fn begin(&mut self, name: String, material: Option<usize>) {
        let run = std::mem::replace(&mut self.run, Run::new(name, material));
        self.runs = self.runs.wrapping_add(1).max(1);
        if !run.indices.is_empty() {
            let made = self.finished(run);
            self.made.push(made);
        }
    }

    /// Ends the last mesh.
    pub(super) fn end(&mut self) {
        self.begin(String::new(), None);
    }

    /// Moves everything back to the file's own `origin` where it reaches about as far as it is away,
    /// as a large model in a small unit does. True if it does.
    pub(super) fn reach_back(&mut self, origin: [f64; 3]) -> bool {
        let places = self.made.iter().flat_map(|m| &m.mesh.positions).flatten();
        let reach = places.fold(0.0f64, |most, c| most.max(f64::from(c.abs())));
        let back = origin.iter().all(|o| o.abs() <= 2.0 * reach);
        if back {
            for place in self.made.iter_mut().flat_map(|m| &mut m.mesh.positions) {
                *place = [0, 1, 2].map(|c| (f64::from(place[c]) + origin[c]) as f32);
            }
        }
        back
    }

    /// A face by its corners' words.
    ///
    /// # Errors
    /// What is wrong with a corner.
    pub(super) fn face(&mut self, words: &str) -> Result<(), String> {
        self.corners.clear();
        for word in words.split_ascii_whitespace() {
            let corner = self.corner(word)?;
            self.corners.push(corner);
        }
        let n = self.corners.len();
        if n < 3 {
            self.thin += 1;
            return Ok(());
        }
        if n == 3 {
            self.triangles.clear();
            self.triangles.push([0, 1, 2]);
        } else {
            self.polygon.clear();
            self.polygon.extend(self.corners.iter().map(|c| self.places[c.place as usize]));
            self.cutter.cut(&self.polygon, &mut self.triangles);
        }
        for triangle in std::mem::take(&mut self.triangles) {
            for k in triangle {
                let index = self.vertex(self.corners[k]);
                self.run.indices.push(index);
            }
        }
        Ok(())
    }

    fn corner(&self, word: &str) -> Result<Corner, String> {
        let counts = [self.places.len(), self.uvs.len(), self.normals.len()];
        let mut parts = [NONE; 3];
        for (k, part) in word.split('/').take(3).enumerate() {
            if part.is_empty() && k > 0 {
                continue;
            }
            parts[k] = index(part, counts[k])
                .ok_or_else(|| format!("face corner '{word}' refers to nothing among {} so far", counts[k]))?;
        }
        let [place, uv, normal] = parts;
        Ok(Corner { place, uv, normal })
    }

    /// The run's vertex that is `corner`: one that it has, or a new one.
    fn vertex(&mut self, corner: Corner) -> u32 {
        let run = &mut self.run;
        let used = &mut self.used[corner.place as usize];
        if used.0 != self.runs {
            *used = (self.runs, NONE);
        }
        let mut at = used.1;
        for _ in 0..LONGEST {
            match run.vertices.get(at as usize) {
                Some(known) if *known == corner => return at,
                Some(_) => at = run.next[at as usize],
                None => break,
            }
        }
        let new = run.vertices.len() as u32;
        run.vertices.push(corner);
        run.next.push(std::mem::replace(&mut used.1, new));
        new
    }

    fn finished(&self, run: Run) -> Made {
        let Run { name, material, vertices, indices, .. } = run;
        let positions = vertices.iter().map(|v| self.places[v.place as usize]).collect();
        let mut mesh = Mesh { name, positions, indices, ..Mesh::default() };
        let of = |list: &[[f32; 3]], i: u32| list.get(i as usize).copied();
        if vertices.iter().any(|v| v.uv != NONE) {
            // OBJ counts v upwards.
            let uv = |v: &Corner| self.uvs.get(v.uv as usize).map_or([0.0, 1.0], |uv| [uv[0], 1.0 - uv[1]]);
            mesh.uv0 = vertices.iter().map(uv).collect();
        }
        let color = |v: &Corner| of(&self.colors, v.place).filter(|c| !c[0].is_nan());
        if !self.colors.is_empty() && vertices.iter().any(|v| color(v).is_some()) {
            let colors = vertices.iter().map(|v| color(v).unwrap_or([1.0; 3]));
            mesh.colors = colors.map(|c| [c[0], c[1], c[2], 1.0]).collect();
        }
        let normals = vertices.iter().filter(|v| v.normal != NONE).count();
        if normals == 0 {
            geometry::make_flat_normals(&mut mesh);
            return Made { mesh, material };
        }
        mesh.normals = vertices.iter().map(|v| of(&self.normals, v.normal).unwrap_or_default()).collect();
        if normals < vertices.len() {
            give_flat(&mut mesh, |i| vertices[i].normal == NONE);
        }
        geometry::normalize_normals(&mut mesh);
        Made { mesh, material }
    }
}

/// Gives corners that lack a normal a vertex of their own with that of their triangle.
fn give_flat(mesh: &mut Mesh, lacks: impl Fn(usize) -> bool) {
    for t in 0..mesh.indices.len() / 3 {
        let corners = [0, 1, 2].map(|k| mesh.indices[3 * t + k] as usize);
        if !corners.iter().any(|&i| lacks(i)) {
            continue;
        }
        let [a, b, c] = corners.map(|i| Vec3::from(mesh.positions[i]).as_dvec3());
        let normal = (b - a).cross(c - a).try_normalize().map_or(Vec3::Y, |n| n.as_vec3());
        for (k, i) in corners.into_iter().enumerate().filter(|(_, i)| lacks(*i)) {
            mesh.indices[3 * t + k] = mesh.positions.len() as u32;
            mesh.positions.push(mesh.positions[i]);
            mesh.normals.push(normal.to_array());
            if let Some(uv) = mesh.uv0.get(i).copied() {
                mesh.uv0.push(uv);
            }
            if let Some(color) = mesh.colors.get(i).copied() {
                mesh.colors.push(color);
            }
        }
    }
}

impl Run {
    fn new(name: String, material: Option<usize>) -> Self {
        Self { name, material, vertices: Vec::new(), next: Vec::new(), indices: Vec::new() }
    }
}

/// An index of OBJ, from 1, or backwards from -1, as one from 0 into `count` things.
fn index(word: &str, count: usize) -> Option<u32> {
    let given: i64 = word.parse().ok()?;
    let count = i64::try_from(count).ok()?;
    let at = if given < 0 { count.checked_add(given)? } else { given - 1 };
    u32::try_from(at).ok().filter(|at| i64::from(*at) < count && *at != NONE)
}
