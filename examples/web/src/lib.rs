//! The module behind the page: a checkered cube, drawn into memory that the page reads.
//!
//! Exports are numbers and addresses, so that one small script can speak to it without a bindings generator:
//!
//! | export | does |
//! | --- | --- |
//! | `draw(yaw, pitch, distance, level, naive)` | draws a frame; the address of its RGBA8 pixels |
//! | `size()` | how many pixels wide and high it is |
//! | `pick(x, y)` | asks what is seen at a pixel; the address of a [`Pick`] |
//! | `blocks(primitive)` | which 8 × 8 blocks a triangle (all of them: −1) rejects, accepts, or tests; the address of a byte each |
#![no_std]

mod cube;

use core::panic::PanicInfo;

use cube::{Cube, Face};
use halfplane::glam::camera::rh::proj::directx;
use halfplane::glam::{Mat4, Vec3, Vec4};
use halfplane::{
    Coverage, CullMode, Fragment, Primitives, ProjectedVertex, Rasterizer, Rect, Setup, Surface, Viewport,
    floor_to_i32, pack_rgba8,
};
use spin::Mutex;

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    core::arch::wasm32::unreachable()
}

const SIZE: usize = 480;
const BLOCK: usize = 8;
const BLOCKS: usize = SIZE / BLOCK;
const BACKGROUND: u32 = 0xff24_1a10;

/// What is seen at a pixel. In memory: eleven 32-bit words.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Pick {
    /// The number of the triangle, or −1 for the background.
    primitive: i32,
    depth: f32,
    /// 1/w_a, 1/w_b, 1/w_c, or zeros of a triangle that was clipped: its corners may lie behind the eye.
    inv_w: [f32; 3],
    /// α', β', γ': linear on the screen.
    barycentrics: [f32; 3],
    /// α, β, γ: perspective-correct.
    weights: [f32; 3],
}

const NOTHING: Pick =
    Pick { primitive: -1, depth: 1.0, inv_w: [0.0; 3], barycentrics: [0.0; 3], weights: [0.0; 3] };

/// Everything that is kept from one call to the next. It begins as zeros, which take no room in the file.
struct App {
    cube: Cube,
    positions: [Vec4; cube::VERTICES],
    projected: [ProjectedVertex; cube::VERTICES],
    color: [u32; SIZE * SIZE],
    depth: [f32; SIZE * SIZE],
    blocks: [u8; BLOCKS * BLOCKS],
    naive: bool,
}

/// A page has one thread: the lock is never waited for.
static APP: Mutex<App> = Mutex::new(App {
    cube: Cube::new(),
    positions: [Vec4::ZERO; cube::VERTICES],
    projected: [ProjectedVertex::BLANK; cube::VERTICES],
    color: [0; SIZE * SIZE],
    depth: [0.0; SIZE * SIZE],
    blocks: [0; BLOCKS * BLOCKS],
    naive: false,
});

static PICK: Mutex<Pick> = Mutex::new(NOTHING);

fn rasterizer() -> Option<Rasterizer<Face>> {
    let mut rasterizer = Rasterizer::new(Viewport::of_size(SIZE as u32, SIZE as u32).ok()?);
    rasterizer.cull_mode = CullMode::Back;
    Some(rasterizer)
}

impl App {
    /// Draws what `scissor` lets through.
    fn draw(&mut self, scissor: Option<Rect>, mut seen: impl FnMut(&Fragment<'_, Face>)) -> Option<()> {
        let mut rasterizer = rasterizer()?;
        rasterizer.scissor = scissor;
        let (positions, varyings) = (self.positions.get(..self.cube.len())?, self.cube.faces());
        let vertices = rasterizer.project(positions, &mut self.projected).ok()?;
        let list = Primitives::list().indexed(self.cube.indices());
        let mut target = Surface::new(&mut self.color, &mut self.depth, SIZE as u32, SIZE as u32).ok()?;
        let naive = self.naive;
        let shade = |fragment: Fragment<'_, Face>| {
            seen(&fragment);
            let Face { uv, uv_naive, light } = fragment.varyings();
            let uv = if naive { uv_naive.0 } else { uv };
            let is_dark = (floor_to_i32(uv.x * 6.0) ^ floor_to_i32(uv.y * 6.0)) & 1;
            let color = Vec3::new(0.95, 0.55 + 0.4 * uv.x, 0.3 + 0.5 * uv.y) * (1.0 - 0.7 * is_dark as f32);
            pack_rgba8((color * light.0).extend(1.0))
        };
        rasterizer.draw(&mut target, list, vertices, varyings, shade).ok()?;
        Some(())
    }

    /// A triangle's corners as they were projected.
    fn corners(&self, triangle: usize) -> Option<[ProjectedVertex; 3]> {
        let [a, b, c] = self.cube.triangle(triangle)?.map(|i| self.projected.get(usize::from(i)).copied());
        Some([a?, b?, c?])
    }

    /// Notes for each block what the edges of a triangle say of it. A block that one triangle covers stays covered.
    fn mark_blocks(&mut self, triangle: usize) -> Option<()> {
        let setup = Setup::new(self.corners(triangle)?)?;
        if !setup.is_counter_clockwise() {
            return None; // culled
        }
        let bounds = setup.bounds().intersection(Rect::of_size(SIZE as u32, SIZE as u32));
        let (left, top) = (bounds.x as usize / BLOCK, bounds.y as usize / BLOCK);
        let (right, bottom) = (bounds.right() as usize, bounds.bottom() as usize);
        for y in top..bottom.div_ceil(BLOCK) {
            for x in left..right.div_ceil(BLOCK) {
                let (x_pixel, y_pixel) = ((x * BLOCK) as i32, (y * BLOCK) as i32);
                let block = Rect { x: x_pixel, y: y_pixel, width: BLOCK as u32, height: BLOCK as u32 };
                let mark = match setup.coverage(block) {
                    Coverage::None => 1,
                    Coverage::Partial => 2,
                    Coverage::Full => 3,
                };
                let old = self.blocks.get_mut(y * BLOCKS + x)?;
                *old = mark.max(*old);
            }
        }
        Some(())
    }
}

/// How many pixels wide and high a frame is.
#[unsafe(no_mangle)]
pub extern "C" fn size() -> usize {
    SIZE
}

/// Draws a frame. `level` quads along each edge of the cube.
#[unsafe(no_mangle)]
pub extern "C" fn draw(yaw: f32, pitch: f32, distance: f32, level: u32, naive: bool) -> *const u32 {
    let app = &mut *APP.lock();
    app.naive = naive;
    app.cube.tessellate(level);
    let projection = directx::perspective(1.1, 1.0, 0.1, 20.0);
    let model = Mat4::from_translation(Vec3::new(0.0, 0.0, -distance))
        * Mat4::from_rotation_x(pitch)
        * Mat4::from_rotation_y(yaw);
    for (position, point) in app.positions.iter_mut().zip(app.cube.points()) {
        *position = projection * (model * point.extend(1.0));
    }
    app.color.fill(BACKGROUND);
    app.depth.fill(1.0);
    app.draw(None, |_| ());
    app.color.as_ptr()
}

/// Asks what the last frame shows at a pixel, by drawing that pixel again.
#[unsafe(no_mangle)]
pub extern "C" fn pick(x: i32, y: i32) -> *const Pick {
    let app = &mut *APP.lock();
    let pixel = Rect { x, y, width: 1, height: 1 };
    if pixel.intersection(Rect::of_size(SIZE as u32, SIZE as u32)) == pixel {
        app.depth[y as usize * SIZE + x as usize] = 1.0;
    }
    let mut pick = NOTHING;
    app.draw(Some(pixel), |fragment| {
        pick = Pick {
            primitive: fragment.primitive_index() as i32,
            depth: fragment.depth(),
            inv_w: [0.0; 3],
            barycentrics: fragment.barycentrics(),
            weights: fragment.weights(),
        };
    });
    if let Some(corners) = usize::try_from(pick.primitive).ok().and_then(|i| app.corners(i))
        && corners.iter().all(|corner| corner.position_subpixel().is_some())
    {
        pick.inv_w = corners.map(ProjectedVertex::inv_w);
    }
    let mut answer = PICK.lock();
    *answer = pick;
    &raw const *answer
}

/// Which 8 × 8 blocks the triangle `primitive`, or every visible one, rejects (1), tests sample by sample (2) or accepts
/// as a whole (3). Blocks outside of all bounding boxes are 0. Triangles that must be clipped are left out.
#[unsafe(no_mangle)]
pub extern "C" fn blocks(primitive: i32) -> *const u8 {
    let app = &mut *APP.lock();
    app.blocks.fill(0);
    for i in 0..app.cube.triangles() {
        if primitive < 0 || usize::try_from(primitive) == Ok(i) {
            app.mark_blocks(i);
        }
    }
    app.blocks.as_ptr()
}
