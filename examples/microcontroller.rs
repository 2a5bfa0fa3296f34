//! A display of 320 × 240 pixels on a microcontroller: no heap, and memory for one tile of 64 × 32 pixels.
//!
//! The shape of real firmware, run on the host: every byte lies in one static, pixels are RGB565, depth has 16 bits, and a
//! tile that is done goes to `send`, as through SPI to a display. Geometry is done once a frame and not once a tile.

mod support;

use core::error::Error;
use halfplane::glam::{Mat4, Vec2, Vec3, Vec4, camera::rh::proj::directx, vec3};
use halfplane::{
    Computed, CullMode, Grid, Primitives, ProjectedVertex, Rasterizer, Record, Rect, Statistics, Surface,
    Viewport, pack_rgb565,
};
use std::sync::Mutex;
use support::image;

const WIDTH: u32 = 320;
const HEIGHT: u32 = 240;
const TILE: (u32, u32) = (64, 32);
const TILE_LEN: usize = (TILE.0 * TILE.1) as usize;
const TILES: usize = (WIDTH.div_ceil(TILE.0) * HEIGHT.div_ceil(TILE.1)) as usize;

/// A torus: so many corners around it, and around its tube.
const AROUND: usize = 32;
const TUBE: usize = 14;

/// How many triangles may be seen at a time. Of a torus about half.
const RECORDS: usize = 512;

/// All memory that a frame takes.
struct Memory {
    /// One tile.
    color: [u16; TILE_LEN],
    depth: [u16; TILE_LEN],
    /// The geometry of the frame.
    vertices: [ProjectedVertex; AROUND * TUBE],
    records: [Record<f32>; RECORDS],
    bins: [u32; Grid::bin_memory(TILES, 2 * RECORDS)],
}

/// In firmware, what the runtime offers for a static that `main` takes once.
static MEMORY: Mutex<Memory> = Mutex::new(Memory {
    color: [0; TILE_LEN],
    depth: [0; TILE_LEN],
    vertices: [ProjectedVertex::BLANK; AROUND * TUBE],
    records: [Record::blank(0.0); RECORDS],
    bins: [0; Grid::bin_memory(TILES, 2 * RECORDS)],
});

/// Corner `i` of the torus, and the direction away from its surface.
fn corner(i: usize) -> (Vec3, Vec3) {
    let turn = |i: usize, of: usize| Vec2::from_angle(core::f32::consts::TAU * i as f32 / of as f32);
    let (around, tube) = (turn(i / TUBE, AROUND), turn(i % TUBE, TUBE));
    let normal = vec3(around.x * tube.x, tube.y, around.y * tube.x);
    (vec3(around.x, 0.0, around.y) + normal * 0.45, normal)
}

/// The corners of its triangles, in flash.
#[expect(clippy::cast_possible_truncation, reason = "there are 448 corners")]
const INDICES: [u16; AROUND * TUBE * 6] = {
    let mut indices = [0; AROUND * TUBE * 6];
    let mut i = 0;
    while i < AROUND * TUBE {
        // This corner, the next along the tube, and both of the next ring.
        let (ring, next_ring) = (i / TUBE * TUBE, (i / TUBE + 1) % AROUND * TUBE);
        let (here, up) = (i % TUBE, (i % TUBE + 1) % TUBE);
        let [a, b, c, d] = [ring + here, ring + up, next_ring + here, next_ring + up];
        let corners = [a, b, c, c, b, d];
        let mut j = 0;
        while j < 6 {
            indices[6 * i + j] = corners[j] as u16;
            j += 1;
        }
        i += 1;
    }
    indices
};

/// Draws a frame and sends it tile by tile.
fn draw_frame(
    memory: &mut Memory,
    angle: f32,
    mut send: impl FnMut(Rect, &[u16]),
) -> Result<Statistics, Box<dyn Error>> {
    let Memory { color, depth, vertices, records, bins } = memory;
    let frame = Rect::of_size(WIDTH, HEIGHT);
    let grid = Grid::new(frame, TILE.0, TILE.1)?;
    let (rasterizer, model, matrix) = scene(angle)?;

    let positions = Computed::new(AROUND * TUBE, |i| matrix * corner(i).0.extend(1.0));
    let light = Computed::new(AROUND * TUBE, |i| brightness(model, i));
    let vertices = rasterizer.project(positions, vertices)?;
    let mut preparation = rasterizer.prepare(frame, Primitives::list().indexed(&INDICES), vertices, light)?;
    let batch = preparation.fill(records)?.unwrap_or_default();
    let bins = rasterizer.bin(&grid, batch, bins)?;
    let mut statistics = preparation.statistics();
    if batch.len() == RECORDS {
        // There may be more. Whoever has less memory prepares again for each tile, in as many batches as it takes.
        return Err(
            format!("{RECORDS} triangles or more may be seen, and there is room for {RECORDS}").into()
        );
    }

    for (index, area) in grid.tiles().enumerate() {
        let len = (area.width * area.height) as usize;
        color[..len].fill(0x10a3);
        depth[..len].fill(u16::MAX);
        let mut tile = Surface::with_planes(&mut color[..], &mut depth[..], area, area.width as usize)?;
        statistics += rasterizer.draw_prepared(&mut tile, bins.tile(index).chain(bins.rest()), |fragment| {
            paint(fragment.varyings())
        });
        send(area, &color[..len]);
    }
    Ok(statistics)
}

fn scene(angle: f32) -> Result<(Rasterizer<f32>, Mat4, Mat4), Box<dyn Error>> {
    let mut rasterizer = Rasterizer::new(Viewport::of_size(WIDTH, HEIGHT)?);
    rasterizer.cull_mode = CullMode::Back;
    let model =
        Mat4::from_rotation_x(0.7) * Mat4::from_rotation_z(angle) * Mat4::from_rotation_y(angle * 2.0);
    let projection = directx::perspective(0.8, WIDTH as f32 / HEIGHT as f32, 1.0, 10.0);
    Ok((rasterizer, model, projection * Mat4::from_translation(vec3(0.0, 0.0, -4.2)) * model))
}

/// How much light falls on a corner.
fn brightness(model: Mat4, i: usize) -> f32 {
    model.transform_vector3(corner(i).1).dot(vec3(0.36, 0.8, 0.48)).max(0.0) * 0.9 + 0.1
}

fn paint(light: f32) -> u16 {
    pack_rgb565(vec3(0.2, 0.85, 0.75) * light)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut display = vec![0u16; (WIDTH * HEIGHT) as usize];
    let (mut sent, mut bytes) = (0, 0);
    let mut memory = MEMORY.lock().expect("main is the only one");
    let statistics = draw_frame(&mut memory, 0.35, |area, pixels| {
        for (y, row) in (area.y as usize..).zip(pixels.chunks(area.width as usize)) {
            let at = y * WIDTH as usize + area.x as usize;
            display[at..at + row.len()].copy_from_slice(row);
        }
        (sent, bytes) = (sent + 1, bytes + pixels.len() * 2);
    })?;
    println!(
        "{} triangles, {} culled, in {} bytes of RAM",
        statistics.primitives,
        statistics.culled,
        size_of::<Memory>()
    );
    println!("{sent} tiles, {bytes} bytes sent, {} fragments", statistics.fragments);
    assert_eq!((sent, bytes), (TILES, display.len() * 2), "every pixel was sent once");

    // What a whole framebuffer would show.
    let (rasterizer, model, matrix) = scene(0.35)?;
    let (mut color, mut depth) = (vec![0x10a3; display.len()], vec![u16::MAX; display.len()]);
    let mut target = Surface::new(&mut color, &mut depth, WIDTH, HEIGHT)?;
    let positions = Computed::new(AROUND * TUBE, |i| -> Vec4 { matrix * corner(i).0.extend(1.0) });
    let light = Computed::new(AROUND * TUBE, |i| brightness(model, i));
    rasterizer.draw(&mut target, Primitives::list().indexed(&INDICES), positions, light, |fragment| {
        paint(fragment.varyings())
    })?;
    assert!(color == display, "the picture does not depend on how the frame is cut");

    let rgba = |c: &u16| {
        let [r, g, b] = [c >> 11, c >> 5 & 0x3f, c & 0x1f].map(u32::from);
        (r * 255 / 31) | (g * 255 / 63) << 8 | (b * 255 / 31) << 16 | 0xff00_0000
    };
    let pixels: Vec<u32> = display.iter().map(rgba).collect();
    image::write_png(&image::output_path("microcontroller"), WIDTH, HEIGHT, &pixels)?;
    Ok(())
}
