//! A lit torus that spins, drawn tile by tile into anything that `embedded-graphics` can draw to.
//!
//! Nothing here knows a processor or a display: the same code runs on a microcontroller and, to compare with, on a
//! computer. The memory is what [`Renderer`] holds, 22 KiB, wherever the caller puts it:
//!
//! | what | bytes |
//! | --- | --- |
//! | one tile of 64 × 32 pixels: RGB565 and 16-bit depth | 8 192 |
//! | the model: 192 points and normals | 4 608 |
//! | a frame's vertices: clip space, projected, lit | 8 448 |
//! | 384 triangles of `u8` indices | 1 152 |
#![no_std]

use embedded_graphics_core::pixelcolor::{Rgb565, raw::RawU16};
use embedded_graphics_core::prelude::{DrawTarget, Point, Size};
use embedded_graphics_core::primitives::Rectangle;
use halfplane::glam::{Mat4, Vec2, Vec3, Vec4};
use halfplane::{CullMode, Primitives, ProjectedVertex, Rasterizer, Rect, Surface, Viewport, pack_rgb565};

/// The display's width and height.
pub const SIZE: u16 = 240;
/// A turn takes this many frames.
pub const FRAMES: u16 = 48;

const TILE: (u16, u16) = (64, 32);
const TILE_PIXELS: usize = TILE.0 as usize * TILE.1 as usize;

/// Points around the torus, and around its tube.
const RING: u8 = 16;
const TUBE: u8 = 12;
const POINTS: usize = RING as usize * TUBE as usize;
const BACKGROUND: u16 = 0x10a4;

/// All the memory that drawing takes.
pub struct Renderer {
    points: [Vec3; POINTS],
    normals: [Vec3; POINTS],
    triangles: [[u8; 3]; 2 * POINTS],
    positions: [Vec4; POINTS],
    projected: [ProjectedVertex; POINTS],
    colors: [Vec3; POINTS],
    color: [u16; TILE_PIXELS],
    depth: [u16; TILE_PIXELS],
}

impl Renderer {
    /// Memory, without a model in it. `const`, so that it can be a `static`.
    pub const fn new() -> Self {
        Self {
            points: [Vec3::ZERO; POINTS],
            normals: [Vec3::ZERO; POINTS],
            triangles: [[0; 3]; 2 * POINTS],
            positions: [Vec4::ZERO; POINTS],
            projected: [ProjectedVertex::BLANK; POINTS],
            colors: [Vec3::ZERO; POINTS],
            color: [0; TILE_PIXELS],
            depth: [0; TILE_PIXELS],
        }
    }

    /// Makes the model: once, at the start.
    pub fn build(&mut self) {
        let angle = |i: u8, n: u8| Vec2::from_angle(core::f32::consts::TAU * f32::from(i) / f32::from(n));
        let places = (0..RING).flat_map(|ring| (0..TUBE).map(move |tube| (ring, tube)));
        for (i, (ring, tube)) in places.enumerate() {
            let (around, across) = (angle(ring, RING), angle(tube, TUBE));
            let normal = Vec3::new(around.x * across.x, across.y, around.y * across.x);
            self.normals[i] = normal;
            self.points[i] = Vec3::new(around.x, 0.0, around.y) + normal * 0.45;
            let index = |ring: u8, tube: u8| ring % RING * TUBE + tube % TUBE;
            let (a, b) = (index(ring, tube), index(ring + 1, tube));
            let (c, d) = (index(ring, tube + 1), index(ring + 1, tube + 1));
            self.triangles[2 * i] = [a, c, b];
            self.triangles[2 * i + 1] = [b, c, d];
        }
    }

    /// Draws frame number `frame` of the turn. `None` only when a constant above is wrong.
    pub fn draw<D: DrawTarget<Color = Rgb565>>(
        &mut self,
        frame: u16,
        display: &mut D,
    ) -> Option<Result<(), D::Error>> {
        let viewport = Viewport::of_size(u32::from(SIZE), u32::from(SIZE)).ok()?;
        let mut rasterizer = Rasterizer::<Vec3>::new(viewport);
        rasterizer.cull_mode = CullMode::Back;

        // Each vertex once a frame: place it, light it, project it.
        let turn = core::f32::consts::TAU * f32::from(frame % FRAMES) / f32::from(FRAMES);
        let model = Mat4::from_translation(Vec3::new(0.0, 0.0, -3.6))
            * Mat4::from_rotation_x(0.6)
            * Mat4::from_rotation_y(turn)
            * Mat4::from_rotation_x(1.0);
        let eye = halfplane::glam::camera::rh::proj::directx::perspective(0.9, 1.0, 0.5, 10.0);
        for i in 0..POINTS {
            self.positions[i] = eye * (model * self.points[i].extend(1.0));
            let normal = (model * self.normals[i].extend(0.0)).truncate();
            let light = normal.dot(Vec3::new(0.48, 0.64, 0.6)).max(0.0);
            let base = if i / usize::from(TUBE) % 2 == 0 {
                Vec3::new(1.0, 0.45, 0.1)
            } else {
                Vec3::new(0.2, 0.6, 0.9)
            };
            self.colors[i] = base * (0.2 + 0.8 * light);
        }
        let vertices = rasterizer.project(&self.positions, &mut self.projected).ok()?;

        // Each tile: clear, draw, send.
        let list = Primitives::list().indexed(self.triangles.as_flattened());
        for y in (0..SIZE).step_by(usize::from(TILE.1)) {
            for x in (0..SIZE).step_by(usize::from(TILE.0)) {
                let (width, height) = (TILE.0.min(SIZE - x), TILE.1.min(SIZE - y));
                let area = Rect { x: x.into(), y: y.into(), width: width.into(), height: height.into() };
                self.color.fill(BACKGROUND);
                self.depth.fill(u16::MAX);
                let mut tile =
                    Surface::with_planes(&mut self.color[..], &mut self.depth[..], area, width.into())
                        .ok()?;
                let shade = |fragment: halfplane::Fragment<'_, Vec3>| pack_rgb565(fragment.varyings());
                rasterizer.draw(&mut tile, list, vertices, &self.colors, shade).ok()?;
                if let Err(error) = send(&tile.area(), &self.color, display) {
                    return Some(Err(error));
                }
            }
        }
        Some(Ok(()))
    }
}

impl Default for Renderer {
    fn default() -> Self {
        Self::new()
    }
}

/// Hands a tile to the display: its pixels, row by row, as such displays take them.
fn send<D: DrawTarget<Color = Rgb565>>(area: &Rect, color: &[u16], display: &mut D) -> Result<(), D::Error> {
    let window = Rectangle::new(Point::new(area.x, area.y), Size::new(area.width, area.height));
    display.fill_contiguous(&window, color.iter().map(|&color| Rgb565::from(RawU16::new(color))))
}

/// What a display's controller is told over its bus: a window, and the pixels that fill it, two bytes each.
pub fn window_bytes(window: &Rectangle) -> impl Iterator<Item = u8> + use<> {
    let Rectangle { top_left: Point { x, y }, size: Size { width, height } } = *window;
    [x as u16, y as u16, width as u16, height as u16].into_iter().flat_map(u16::to_be_bytes)
}
