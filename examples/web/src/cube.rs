//! A cube whose faces are cut into level × level quads.

use halfplane::glam::{Vec2, Vec3};
use halfplane::{Flat, NoPerspective};

const MOST: usize = 16;
/// The most vertices that there can be.
pub const VERTICES: usize = 6 * (MOST + 1) * (MOST + 1);
const TRIANGLES: usize = 6 * MOST * MOST * 2;

/// What a vertex of a face has: its place on the face, twice, so that the page can show both ways to interpolate.
#[derive(Clone, Copy)]
pub struct Face {
    pub uv: Vec2,
    pub uv_naive: NoPerspective<Vec2>,
    pub light: Flat<f32>,
}

halfplane::varyings!(Face { uv, uv_naive, light });

pub struct Cube {
    level: usize,
    points: [Vec3; VERTICES],
    faces: [Face; VERTICES],
    indices: [u16; 3 * TRIANGLES],
}

impl Cube {
    pub const fn new() -> Self {
        let face = Face { uv: Vec2::ZERO, uv_naive: NoPerspective(Vec2::ZERO), light: Flat(0.0) };
        Self {
            level: 0,
            points: [Vec3::ZERO; VERTICES],
            faces: [face; VERTICES],
            indices: [0; 3 * TRIANGLES],
        }
    }

    /// How many vertices there are now.
    pub fn len(&self) -> usize {
        6 * (self.level + 1) * (self.level + 1)
    }

    pub fn triangles(&self) -> usize {
        6 * self.level * self.level * 2
    }

    pub fn points(&self) -> &[Vec3] {
        &self.points[..self.len()]
    }

    pub fn faces(&self) -> &[Face] {
        &self.faces[..self.len()]
    }

    pub fn indices(&self) -> &[u16] {
        &self.indices[..3 * self.triangles()]
    }

    pub fn triangle(&self, i: usize) -> Option<[u16; 3]> {
        self.indices().chunks_exact(3).nth(i)?.try_into().ok()
    }

    /// Cuts each face into level × level quads.
    pub fn tessellate(&mut self, level: u32) {
        let level = (level as usize).clamp(1, MOST);
        if level == self.level {
            return;
        }
        self.level = level;
        // Normal, and the directions of u and v; u × v is the normal, so that all faces wind alike.
        const SIDES: [[Vec3; 3]; 6] = [
            [Vec3::Z, Vec3::X, Vec3::Y],
            [Vec3::NEG_Z, Vec3::NEG_X, Vec3::Y],
            [Vec3::X, Vec3::NEG_Z, Vec3::Y],
            [Vec3::NEG_X, Vec3::Z, Vec3::Y],
            [Vec3::Y, Vec3::X, Vec3::NEG_Z],
            [Vec3::NEG_Y, Vec3::X, Vec3::Z],
        ];
        let row = level + 1;
        let (mut vertex, mut index) = (0, 0);
        for (side, [normal, right, up]) in SIDES.into_iter().enumerate() {
            let first = vertex;
            for y in 0..row {
                for x in 0..row {
                    let uv = Vec2::new(x as f32, y as f32) / level as f32;
                    self.points[vertex] = normal + right * (2.0 * uv.x - 1.0) + up * (2.0 * uv.y - 1.0);
                    let light = Flat([1.0, 0.9, 0.75, 0.65, 0.95, 0.55][side]);
                    self.faces[vertex] = Face { uv, uv_naive: NoPerspective(uv), light };
                    vertex += 1;
                }
            }
            for y in 0..level {
                for x in 0..level {
                    let a = first + y * row + x;
                    for corner in [a, a + 1, a + row, a + row, a + 1, a + row + 1] {
                        self.indices[index] = corner as u16;
                        index += 1;
                    }
                }
            }
        }
    }
}
