//! A lit teapot with a checker on it, ready for any rasterizer, tile or thread.

use super::{camera::OrbitCamera, image, mesh::Mesh, shade::unit, teapot};
use halfplane::glam::{Vec2, Vec3, Vec4, vec3};
use halfplane::{CullMode, Rasterizer, Viewport, ViewportError, floor_to_i32};

/// What a corner of the teapot has and a fragment gets.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lit {
    /// Of length 1 at the corners.
    pub normal: Vec3,
    /// One repeat of the checker a half.
    pub uv: Vec2,
}

halfplane::varyings!(Lit { normal, uv });

/// Colour where nothing is.
pub const BACKGROUND: u32 = 0xff26_1a18;

/// The teapot in clip space.
#[derive(Clone, Debug)]
pub struct Scene {
    pub positions: Vec<Vec4>,
    pub values: Vec<Lit>,
    pub indices: Vec<u32>,
}

impl Scene {
    /// With `level` cells along each side of each patch, in a picture `aspect` times as wide as high.
    pub fn teapot(level: u32, aspect: f32) -> Self {
        let mut mesh: Mesh = teapot::tessellate(level, |_, _| ());
        mesh.fit_unit_sphere();
        let matrix = OrbitCamera { distance: 3.3, ..OrbitCamera::default() }.view_projection(aspect);
        let values = mesh.normals.iter().zip(&mesh.uvs).map(|(&normal, &uv)| Lit { normal, uv }).collect();
        let positions = mesh.positions.iter().map(|p| matrix * p.extend(1.0)).collect();
        Self { positions, values, indices: mesh.indices }
    }

    /// For a picture of this size.
    ///
    /// # Errors
    ///
    /// When the size is not legal.
    pub fn rasterizer(&self, width: u32, height: u32) -> Result<Rasterizer<Lit>, ViewportError> {
        let mut rasterizer = Rasterizer::new(Viewport::of_size(width, height)?);
        rasterizer.cull_mode = CullMode::Back;
        Ok(rasterizer)
    }
}

/// The colour of a fragment: `0xAABBGGRR`.
#[inline(always)]
pub fn color(Lit { normal, uv }: Lit) -> u32 {
    let light = unit(normal).dot(vec3(0.36, 0.8, 0.48)).max(0.0) + 0.08;
    let cells = uv * 8.0;
    let is_dark = (floor_to_i32(cells.x) ^ floor_to_i32(cells.y)) & 1 == 0;
    let albedo = if is_dark { vec3(0.07, 0.24, 0.42) } else { vec3(0.9, 0.72, 0.5) };
    image::encode(albedo * light)
}

/// A number that pictures with other pixels have not (FNV-1a).
pub fn hash(pixels: &[u32]) -> u64 {
    pixels.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &pixel| {
        (hash ^ u64::from(pixel)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}
