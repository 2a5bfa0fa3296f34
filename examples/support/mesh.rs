//! Indexed triangle meshes, and OBJ files through `tobj`.

use core::error::Error;
use halfplane::glam::{Vec2, Vec3};
use std::collections::{HashMap, HashSet};
use std::{fs::File, io::BufReader, path::Path};

/// Triangles, counter-clockwise from outside; `positions`, `normals` and `uvs` are of one length.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// In model space, y up.
    pub positions: Vec<Vec3>,
    /// Unit vectors, outwards.
    pub normals: Vec<Vec3>,
    /// Texture coordinates: u right, v down, one repeat of the texture a unit.
    pub uvs: Vec<Vec2>,
    /// Three for each triangle.
    pub indices: Vec<u32>,
}

impl Mesh {
    /// How many triangles there are.
    pub fn triangles(&self) -> usize {
        self.indices.len() / 3
    }

    /// Moves and scales the mesh so that it fills the unit sphere around the origin.
    ///
    /// Positions that are not finite are left as they are; a mesh of one point is moved only.
    pub fn fit_unit_sphere(&mut self) {
        let finite = || self.positions.iter().copied().filter(|p| p.is_finite());
        let Some(first) = finite().next() else { return };
        let (low, high) = finite().fold((first, first), |(low, high), p| (low.min(p), high.max(p)));
        let centre = low * 0.5 + high * 0.5; // halved first: the sum may overflow
        let radius = finite().map(|p| p.distance(centre)).fold(0.0, f32::max);
        let radius = if radius > 0.0 { radius } else { 1.0 };
        for p in &mut self.positions {
            *p = (*p - centre) / radius;
        }
    }

    /// Sets each normal that is missing or zero to the sum of the faces around its position, weighted by
    /// their area.
    ///
    /// Vertices at one position share it, so that the seams of a texture stay smooth.
    pub fn fill_normals(&mut self) {
        self.normals.resize(self.positions.len(), Vec3::ZERO);
        let point = self.points();
        let mut sums = vec![Vec3::ZERO; self.positions.len()];
        for [a, b, c] in self.corners() {
            let [p, q, r] = [a, b, c].map(|i| self.positions[i]);
            for corner in [a, b, c] {
                sums[point[corner]] += (q - p).cross(r - p);
            }
        }
        for (normal, point) in self.normals.iter_mut().zip(point) {
            *normal = normal.try_normalize().or(sums[point].try_normalize()).unwrap_or(Vec3::Y);
        }
    }

    /// Counts the edges with a triangle on one side only; 0 for a closed surface.
    ///
    /// Edges meet where their ends have the same bits, which is what leaves no gap when the mesh is drawn.
    ///
    /// # Errors
    ///
    /// Names what is wrong in a mesh that is no surface: lengths that differ, an index out of range, values
    /// that are not finite, a normal that is not of unit length, a triangle without area, or an edge that two
    /// triangles use in the same direction.
    pub fn open_edges(&self) -> Result<usize, String> {
        let count = self.positions.len();
        if self.normals.len() != count || self.uvs.len() != count || self.indices.len() % 3 != 0 {
            return Err(format!("{count} positions, but the other arrays differ in length"));
        }
        if let Some(index) = self.indices.iter().find(|&&index| index as usize >= count) {
            return Err(format!("index {index} of {count} vertices"));
        }
        for (i, normal) in self.normals.iter().enumerate() {
            if !normal.is_finite() || (normal.length_squared() - 1.0).abs() > 1e-5 {
                return Err(format!("normal {i} is {normal}"));
            }
            if !self.positions[i].is_finite() || !self.uvs[i].is_finite() {
                return Err(format!("vertex {i} is at {}, uv {}", self.positions[i], self.uvs[i]));
            }
        }

        let point = self.points();
        let mut edges = HashSet::with_capacity(self.indices.len());
        for (triangle, corners) in self.corners().enumerate() {
            let [p, q, r] = corners.map(|i| self.positions[i]);
            if (q - p).cross(r - p) == Vec3::ZERO {
                return Err(format!("triangle {triangle} has no area: {p}, {q}, {r}"));
            }
            let [a, b, c] = corners.map(|i| point[i]);
            for edge in [(a, b), (b, c), (c, a)] {
                if !edges.insert(edge) {
                    return Err(format!("triangle {triangle} uses edge {edge:?} for the second time"));
                }
            }
        }
        Ok(edges.iter().filter(|&&(a, b)| !edges.contains(&(b, a))).count())
    }

    /// For each vertex, the first one with the same position.
    fn points(&self) -> Vec<usize> {
        let mut first = HashMap::with_capacity(self.positions.len());
        let same = |(i, p): (usize, &Vec3)| *first.entry(p.to_array().map(f32::to_bits)).or_insert(i);
        self.positions.iter().enumerate().map(same).collect()
    }

    /// The three indices of each triangle.
    pub fn corners(&self) -> impl Iterator<Item = [usize; 3]> {
        self.indices.chunks_exact(3).map(|corners| [0, 1, 2].map(|i| corners[i] as usize))
    }
}

/// Reads all models of an OBJ file as one mesh, polygons cut into triangles, materials ignored.
///
/// Normals that the file lacks are computed, texture coordinates that it lacks are a projection along z.
///
/// # Errors
///
/// A file that cannot be read, is no OBJ file, or holds no triangle; the message starts with the path.
pub fn load_obj(path: &Path) -> Result<Mesh, Box<dyn Error>> {
    let fail = |what: String| format!("{}: {what}", path.display());
    let mut file = BufReader::new(File::open(path).map_err(|e| fail(e.to_string()))?);
    let no_materials = |_: &Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut file, &tobj::GPU_LOAD_OPTIONS, no_materials)
        .map_err(|e| fail(e.to_string()))?;

    let mut mesh = Mesh::default();
    for tobj::Model { mesh: model, name } in models {
        let base = u32::try_from(mesh.positions.len())?;
        let count = model.positions.len() / 3;
        if let Some(index) = model.indices.iter().find(|&&index| index as usize >= count) {
            return Err(fail(format!("model `{name}` uses vertex {index} of {count}")).into());
        }
        let positions = model.positions.chunks_exact(3).map(Vec3::from_slice);
        mesh.positions.extend(positions);
        let normals = model.normals.chunks_exact(3).map(Vec3::from_slice);
        mesh.normals.extend(normals.take(count));
        mesh.normals.resize(mesh.positions.len(), Vec3::ZERO);
        // OBJ counts v from the bottom of the texture, and our textures' rows begin at the top.
        let uvs = model.texcoords.chunks_exact(2).map(|uv| Vec2::new(uv[0], 1.0 - uv[1]));
        mesh.uvs.extend(uvs.take(count));
        let planar = mesh.positions[mesh.uvs.len()..].iter().map(|p| Vec2::new(p.x, -p.y));
        mesh.uvs.extend(planar);
        mesh.indices.extend(model.indices.iter().map(|index| base + index));
    }
    if mesh.indices.is_empty() {
        return Err(fail("no triangles".into()).into());
    }
    mesh.fill_normals();
    Ok(mesh)
}
