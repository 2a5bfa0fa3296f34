//! The Utah teapot, from its own bicubic Bézier patches.
//!
//! Martin Newell measured and drew it at the University of Utah in 1975 (M. E. Newell, *The Utilization of
//! Procedure Models in Digital Image Synthesis*, doctoral thesis). James Blinn divided its height by about
//! 1.3, and these proportions stayed. Frank Crow added the bottom (*The Origins of the Teapot*, IEEE CG&A
//! 7(1), 1987). The numbers have passed freely from program to program since then: Eric Haines' Standard
//! Procedural Databases, GLUT, three.js; the Computer Graphics Archive (<https://casual-effects.com/data>)
//! lists the model as CC0.
//!
//! The usual table has 32 patches over 306 control points, of which 12 repeat others and 4 go unused. Most of
//! the 290 left are implied by symmetry: body and lid are one profile in four quarter turns, handle and spout
//! are one half and its mirror image. The 130 numbers below expand to those patches, digit for digit.

use super::mesh::Mesh;
use halfplane::glam::{Vec2, Vec3};

/// Rings of one radius each, from the rim's inner edge over the belly to the middle of the bottom.
///
/// Each row is a radius, the length of the handles that round a quarter of a circle, and a height.
/// Rings 0, 3, 6, … lie on the surface, the two between them shape it.
const BODY: [[f32; 3]; 13] = [
    [1.4, 0.784, 2.4],
    [1.3375, 0.749, 2.53125],
    [1.4375, 0.805, 2.53125],
    [1.5, 0.84, 2.4],
    [1.75, 0.98, 1.875],
    [2.0, 1.12, 1.35],
    [2.0, 1.12, 0.9],
    [2.0, 1.12, 0.45],
    [1.5, 0.84, 0.225],
    [1.5, 0.84, 0.15],
    [1.5, 0.84, 0.075],
    [1.425, 0.798, 0.0],
    [0.0, 0.0, 0.0],
];

/// As [`BODY`], from the knob's top to the lid's edge.
const LID: [[f32; 3]; 7] = [
    [0.0, 0.0, 3.15],
    [0.8, 0.45, 3.15],
    [0.0, 0.0, 2.85],
    [0.2, 0.112, 2.7],
    [0.4, 0.224, 2.55],
    [1.3, 0.728, 2.55],
    [1.3, 0.728, 2.4],
];

/// Rings around a tube that lies in the plane z = 0, from its upper end to its lower one.
///
/// Each row is two points (x, y) of that plane, on opposite sides of the tube, and half the width of its
/// control points.
const HANDLE: [[f32; 5]; 7] = [
    [-1.6, 2.025, -1.5, 2.25, 0.3],
    [-2.3, 2.025, -2.5, 2.25, 0.3],
    [-2.7, 2.025, -3.0, 2.25, 0.3],
    [-2.7, 1.8, -3.0, 1.8, 0.3],
    [-2.7, 1.575, -3.0, 1.35, 0.3],
    [-2.5, 1.125, -2.65, 0.9375, 0.3],
    [-2.0, 0.9, -1.9, 0.6, 0.3],
];

/// As [`HANDLE`], from the body to the tip.
const SPOUT: [[f32; 5]; 7] = [
    [1.7, 1.425, 1.7, 0.6, 0.66],
    [2.6, 1.425, 3.1, 0.825, 0.66],
    [2.3, 2.1, 2.4, 2.025, 0.25],
    [2.7, 2.4, 3.3, 2.4, 0.25],
    [2.8, 2.475, 3.525, 2.49375, 0.25],
    [2.9, 2.475, 3.45, 2.5125, 0.15],
    [2.8, 2.4, 3.2, 2.4, 0.15],
];

/// Levels outside [`MIN_LEVEL`]`..=`[`MAX_LEVEL`] have no teapot: at 1 the handle's halves fall together.
pub const MIN_LEVEL: u32 = 2;
/// 67 million triangles, 2 GB.
pub const MAX_LEVEL: u32 = 1024;

/// How many triangles [`tessellate`] makes: two in each cell of each patch, one in those that touch a pole.
pub const fn triangle_count(level: u32) -> usize {
    let level = level as usize;
    32 * 2 * level * level - 2 * 4 * level
}

/// Cuts each of the 32 patches into `level` × `level` cells, and tells `progress` how many rows of how many
/// are done.
///
/// The model stands on y = 0 and is 3.15 high; the spout points to +x. Triangles are counter-clockwise from
/// outside. Body, lid, handle and spout are surfaces of their own, as Newell made them, each closed but for
/// its rims: one can look through the gap beside the lid, so draw both faces. Texture coordinates run around
/// each part a whole number of times and keep the texture's proportions along it.
///
/// # Panics
///
/// If `level` is outside [`MIN_LEVEL`]`..=`[`MAX_LEVEL`].
pub fn tessellate(level: u32, mut progress: impl FnMut(usize, usize)) -> Mesh {
    assert!((MIN_LEVEL..=MAX_LEVEL).contains(&level), "level {level} is not in {MIN_LEVEL}..={MAX_LEVEL}");
    let parts = [
        Part::new(&BODY, quarter_turns, 4.0),
        Part::new(&LID, quarter_turns, 3.0),
        Part::new(&HANDLE, mirrored_halves, 1.0),
        Part::new(&SPOUT, mirrored_halves, 1.0),
    ];
    let cells = level as usize;
    let total = parts.iter().map(|part| part.rows(cells)).sum();
    let mut done = 0;

    let mut mesh = Mesh::default();
    mesh.indices.reserve_exact(triangle_count(level) * 3);
    for part in &parts {
        part.tessellate(cells, &mut mesh, || {
            done += 1;
            progress(done, total);
        });
    }
    mesh
}

/// Checks what the mesh promises: unit normals on the side that the winding says, no triangle without area,
/// no edge open but the rims of the four parts.
///
/// # Errors
///
/// Says which promise is broken, and where.
pub fn check(mesh: &Mesh, level: u32) -> Result<(), String> {
    let expected = triangle_count(level);
    if mesh.triangles() != expected {
        return Err(format!("{} triangles, not {expected}", mesh.triangles()));
    }
    // Rims, in patch edges: the body 4, the lid 4, the handle and the spout 2 at each end.
    let (open, expected) = (mesh.open_edges()?, 16 * level as usize);
    if open != expected {
        return Err(format!("{open} open edges, not {expected}"));
    }
    let mut faces = vec![Vec3::ZERO; mesh.positions.len()];
    for corners in mesh.corners() {
        let [p, q, r] = corners.map(|i| mesh.positions[i]);
        for i in corners {
            faces[i] += (q - p).cross(r - p);
        }
    }
    for (i, (normal, face)) in mesh.normals.iter().zip(faces).enumerate() {
        if normal.dot(face) <= 0.0 {
            return Err(format!("normal {i}, {normal}, points to the back of its triangles"));
        }
    }
    Ok(())
}

/// The control points of four quarter turns around the y axis, from +x over +z, the first point again at the
/// end.
fn quarter_turns(&[r, h, y]: &[f32; 3]) -> Vec<Vec3> {
    #[rustfmt::skip]
    let xz = [
        [r, 0.0], [r, h], [h, r],
        [0.0, r], [-h, r], [-r, h],
        [-r, 0.0], [-r, -h], [-h, -r],
        [0.0, -r], [h, -r], [r, -h],
        [r, 0.0],
    ];
    xz.map(|[x, z]| Vec3::new(x, y, z)).to_vec()
}

/// The control points of a tube's half at +z and of its mirror image at −z, the first point again at the end.
fn mirrored_halves(&[x0, y0, x1, y1, z]: &[f32; 5]) -> Vec<Vec3> {
    vec![
        Vec3::new(x0, y0, 0.0),
        Vec3::new(x0, y0, z),
        Vec3::new(x1, y1, z),
        Vec3::new(x1, y1, 0.0),
        Vec3::new(x1, y1, -z),
        Vec3::new(x0, y0, -z),
        Vec3::new(x0, y0, 0.0),
    ]
}

/// A net of control points: u runs along a ring, v from ring to ring, and each 4 × 4 points from a multiple
/// of three on are a patch.
struct Part {
    rings: Vec<Vec<Vec3>>,
    /// How often the texture goes around.
    repeats: f32,
}

/// A row of vertices in the mesh.
#[derive(Clone, Copy)]
struct Row {
    start: usize,
    is_pole: bool,
}

impl Part {
    fn new<const N: usize>(rows: &[[f32; N]], ring: fn(&[f32; N]) -> Vec<Vec3>, repeats: f32) -> Self {
        let rings = rows.iter().map(ring).collect();
        Self { rings, repeats }
    }

    /// Rows of vertices, for patches of so many cells in each direction.
    fn rows(&self, cells: usize) -> usize {
        self.rings.len() / 3 * cells + 1
    }

    /// Adds the surface to `mesh`.
    ///
    /// Patches share the vertices between them, and where a ring closes, the last vertex copies the first but
    /// for its texture coordinates. So there are no two computations that have to agree, and nothing can
    /// gape.
    fn tessellate(&self, cells: usize, mesh: &mut Mesh, mut row_done: impl FnMut()) {
        let columns = self.rings[0].len() / 3 * cells;
        let around = self.rings.iter().map(|ring| path_length(ring)).fold(0.0, f32::max);

        let mut texture_v = 0.0;
        let mut above = None;
        for row in 0..self.rows(cells) {
            // The last row is the end of the last patch, every other one inside a patch or at its beginning.
            let patch = (row / cells).min(self.rings.len() / 3 - 1);
            let v = (row - patch * cells) as f32 / cells as f32;
            let here = self.vertices(columns, patch, v, texture_v, mesh);
            if let Some(above) = above {
                connect(above, here, columns, &mut mesh.indices);
            }
            above = Some(here);
            texture_v += self.length_along(patch) / around * self.repeats / cells as f32;
            row_done();
        }
    }

    /// Adds a row of vertices, at the height `v` of a row of patches.
    fn vertices(&self, columns: usize, patch: usize, v: f32, texture_v: f32, mesh: &mut Mesh) -> Row {
        // Four rings blend into one whose curves lie on the surface.
        let rings = four(&self.rings, patch);
        let blend = |weights| -> Vec<Vec3> {
            let points = 0..rings[0].len();
            points.map(|i| combine(weights, rings.map(|ring| ring[i]))).collect()
        };
        let (ring, ring_dv) = (blend(bernstein(v)), blend(bernstein_derivative(v)));

        let is_pole = ring.iter().all(|point| *point == ring[0]);
        let start = mesh.positions.len();
        let cells = columns / (ring.len() / 3);
        // A pole has one vertex for each triangle that ends there, so that each can have its own u.
        for column in 0..=columns - usize::from(is_pole) {
            let (position, normal) = if column > 0 && (is_pole || column == columns) {
                (mesh.positions[start], mesh.normals[start])
            } else {
                let patch = column / cells;
                let u = (column - patch * cells) as f32 / cells as f32;
                let dv = combine(bernstein(u), four(&ring_dv, patch));
                if is_pole {
                    // Here ∂/∂u is zero. Beside the pole it is (v − pole) ∂²/∂u∂v to first order, so the
                    // normal has a limit.
                    let away = if v < 0.5 { 1.0 } else { -1.0 };
                    let du = combine(bernstein_derivative(u), four(&ring_dv, patch)) * away;
                    (ring[0], du.cross(dv).normalize())
                } else {
                    let du = combine(bernstein_derivative(u), four(&ring, patch));
                    (combine(bernstein(u), four(&ring, patch)), du.cross(dv).normalize())
                }
            };
            // Seen from outside, columns run to the left.
            let turn = (column as f32 + if is_pole { 0.5 } else { 0.0 }) / columns as f32;
            mesh.positions.push(position);
            mesh.normals.push(normal);
            mesh.uvs.push(Vec2::new((1.0 - turn) * self.repeats, texture_v));
        }
        Row { start, is_pole }
    }

    /// The length of a row of patches, from its first ring to its last one, on the average.
    fn length_along(&self, patch: usize) -> f32 {
        let rings = four(&self.rings, patch);
        let count = rings[0].len();
        (0..count).map(|i| path_length(&rings.map(|ring| ring[i]))).sum::<f32>() / count as f32
    }
}

/// Adds the triangles between two rows; a cell has two, or one where a side is shrunk to a pole.
fn connect(above: Row, below: Row, columns: usize, indices: &mut Vec<u32>) {
    let index = |i: usize| u32::try_from(i).expect("vertices are countable up to MAX_LEVEL");
    for column in 0..columns {
        // a ← b    as seen from outside
        // d ← c
        let [b, a] = [0, 1].map(|i| index(above.start + column + i));
        let [c, d] = [0, 1].map(|i| index(below.start + column + i));
        match (above.is_pole, below.is_pole) {
            (true, _) => indices.extend([b, d, c]),
            (_, true) => indices.extend([b, a, c]),
            _ => indices.extend([b, a, d, b, d, c]),
        }
    }
}

/// The control points, or rings of them, of the patch with that number.
fn four<T>(net: &[T], patch: usize) -> [&T; 4] {
    [0, 1, 2, 3].map(|i| &net[3 * patch + i])
}

fn combine(weights: [f32; 4], points: [impl core::borrow::Borrow<Vec3>; 4]) -> Vec3 {
    let [a, b, c, d] = points.map(|point| *point.borrow());
    a * weights[0] + b * weights[1] + c * weights[2] + d * weights[3]
}

/// The cubic Bernstein polynomials.
fn bernstein(t: f32) -> [f32; 4] {
    let s = 1.0 - t;
    [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t]
}

/// The derivatives of [`bernstein`].
fn bernstein_derivative(t: f32) -> [f32; 4] {
    let s = 1.0 - t;
    [-3.0 * s * s, 3.0 * s * (s - 2.0 * t), 3.0 * t * (2.0 * s - t), 3.0 * t * t]
}

/// About the length of the curves through every third point: the mean of control polygon and chords, which
/// for a quarter of a circle is right to half a percent.
fn path_length(points: &[Vec3]) -> f32 {
    let polygon: f32 = points.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    let ends: Vec<Vec3> = points.iter().copied().step_by(3).collect();
    let chords: f32 = ends.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    (polygon + chords) * 0.5
}
