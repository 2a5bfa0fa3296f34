//! A display of 320 × 240 pixels on a microcontroller: no heap, and memory for one tile of 64 × 32 pixels.
//!
//! The shape of real firmware, run on the host: every byte lies in one static, pixels are RGB565, depth has 16 bits, and a
//! tile that is done goes to `send`, as through SPI to a display. Geometry is done once a frame and not once a tile.

mod support;

use core::error::Error;
use halfplane::glam::{Mat4, Vec4, vec3};
use halfplane::{
    Computed, CullMode, Grid, Primitives, ProjectedVertex, Rasterizer, Record, Rect, Statistics, Surface,
    Viewport, pack_rgb565,
};
use std::sync::Mutex;
use support::{image, torus};

const WIDTH: u32 = 320;
const HEIGHT: u32 = 240;
const TILE: (u32, u32) = (64, 32);
const TILE_LEN: usize = (TILE.0 * TILE.1) as usize;
const TILES: usize = (WIDTH.div_ceil(TILE.0) * HEIGHT.div_ceil(TILE.1)) as usize;

/// How many triangles may be seen at a time. Of a torus about half.
const RECORDS: usize = 512;

/// All memory that a frame takes.
struct Memory {
    /// One tile.
    color: [u16; TILE_LEN],
    depth: [u16; TILE_LEN],
    /// The geometry of the frame.
    vertices: [ProjectedVertex; torus::CORNERS],
    records: [Record<f32>; RECORDS],
    bins: [u32; Grid::bin_memory(TILES, 2 * RECORDS)],
}

/// In firmware, what the runtime offers for a static that `main` takes once.
static MEMORY: Mutex<Memory> = Mutex::new(Memory {
    color: [0; TILE_LEN],
    depth: [0; TILE_LEN],
    vertices: [ProjectedVertex::BLANK; torus::CORNERS],
    records: [Record::blank(0.0); RECORDS],
    bins: [0; Grid::bin_memory(TILES, 2 * RECORDS)],
});

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

    let positions = Computed::new(torus::CORNERS, |i| matrix * torus::corner(i).0.extend(1.0));
    let light = Computed::new(torus::CORNERS, |i| torus::brightness(model, i));
    let vertices = rasterizer.project(positions, vertices)?;
    let mut preparation =
        rasterizer.prepare(frame, Primitives::list().indexed(&torus::INDICES), vertices, light)?;
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
    let (model, matrix) = torus::matrices(angle, WIDTH as f32 / HEIGHT as f32);
    Ok((rasterizer, model, matrix))
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
    let positions = Computed::new(torus::CORNERS, |i| -> Vec4 { matrix * torus::corner(i).0.extend(1.0) });
    let light = Computed::new(torus::CORNERS, |i| torus::brightness(model, i));
    rasterizer.draw(
        &mut target,
        Primitives::list().indexed(&torus::INDICES),
        positions,
        light,
        |fragment| paint(fragment.varyings()),
    )?;
    assert!(color == display, "the picture does not depend on how the frame is cut");

    let rgba = |c: &u16| {
        let [r, g, b] = [c >> 11, c >> 5 & 0x3f, c & 0x1f].map(u32::from);
        (r * 255 / 31) | (g * 255 / 63) << 8 | (b * 255 / 31) << 16 | 0xff00_0000
    };
    let pixels: Vec<u32> = display.iter().map(rgba).collect();
    image::write_png(&image::output_path("microcontroller"), WIDTH, HEIGHT, &pixels)?;
    Ok(())
}
