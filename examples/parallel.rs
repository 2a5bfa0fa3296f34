//! All cores on one frame, with nothing but `std::thread::scope`: the geometry half in parts of the mesh, the fragment half
//! in tiles of the frame. The same bits for any number of threads and any size of tiles.
//!
//! A `Mutex` around an iterator is all the scheduler that this takes. `parallel_rayon` does the same with rayon.

mod support;

use core::error::Error;
use halfplane::{Bins, Grid, Primitives, Projected, ProjectedVertex, Record, Rect};
use std::{sync::Mutex, thread};
use support::{cuts, image, scene};

const WIDTH: u32 = 1280;
const HEIGHT: u32 = 960;

/// How many triangles or vertices a thread takes at a time: their records fit into a core's own cache.
const CHUNK: usize = 2048;

fn main() -> Result<(), Box<dyn Error>> {
    let scene = scene::Scene::teapot(48, WIDTH as f32 / HEIGHT as f32);
    println!("{} triangles", scene.indices.len() / 3);
    let picture = cuts::compare((WIDTH, HEIGHT), |threads, tile| draw(&scene, threads, tile))?;
    image::write_png(&image::output_path("parallel"), WIDTH, HEIGHT, &picture)?;
    Ok(())
}

/// Draws a frame.
fn draw(scene: &scene::Scene, threads: usize, tile: (u32, u32)) -> Result<Vec<u32>, Box<dyn Error>> {
    let frame = Rect::of_size(WIDTH, HEIGHT);
    let grid = Grid::new(frame, tile.0, tile.1)?;
    let rasterizer = scene.rasterizer(WIDTH, HEIGHT)?;
    let primitives = Primitives::list().indexed(&scene.indices);
    let triangles = primitives.triangle_count(scene.positions.len());

    // Vertices, each once.
    let mut room = vec![ProjectedVertex::default(); scene.positions.len()];
    let chunks = scene.positions.chunks(CHUNK).zip(room.chunks_mut(CHUNK));
    for_each(threads, chunks, |(positions, room)| {
        rasterizer.project(positions, room).expect("they are of one length");
    });
    let vertices = Projected::new(&room, &scene.positions[..])?;

    // Triangles: records, and which tiles they touch. A triangle makes one record at most, so all of a chunk fit.
    let mut records = vec![Record::default(); triangles];
    let chunks = triangles.div_ceil(CHUNK);
    let memory_len = Grid::bin_memory(grid.len(), grid.len() + 2 * CHUNK);
    let mut memory = vec![0; chunks * memory_len];
    let mut bins: Vec<Option<Bins<'_, '_, _>>> = vec![None; chunks];
    let parts = (0..triangles).step_by(CHUNK).map(|first| primitives.part(first, first + CHUNK));
    let chunks = parts.zip(records.chunks_mut(CHUNK)).zip(memory.chunks_mut(memory_len)).zip(&mut bins);
    for_each(threads, chunks, |(((part, records), memory), bins)| {
        let mut preparation =
            rasterizer.prepare(frame, part, vertices, &scene.values[..]).expect("the indices are right");
        let batch = preparation.fill(records).expect("there is room").unwrap_or_default();
        *bins = Some(rasterizer.bin(&grid, batch, memory).expect("it is long enough"));
    });

    // Tiles: each has its own memory, and its records in the order of the mesh. Those for which a chunk's bins had no
    // room are drawn after those in them, so that nothing changes but the time that it takes.
    let mut pixels = vec![scene::BACKGROUND; grid.len() * grid.tile_len()];
    let mut depth = vec![1.0f32; grid.len() * grid.tile_len()];
    let tiles = grid.surfaces(&mut pixels[..], &mut depth[..])?;
    for_each(threads, tiles.enumerate(), |(index, mut tile)| {
        let records = bins.iter().flatten().flat_map(|bins| bins.tile(index).chain(bins.rest()));
        rasterizer.draw_prepared(&mut tile, records, |fragment| scene::color(fragment.varyings()));
    });
    let mut picture = vec![0; WIDTH as usize * HEIGHT as usize];
    grid.copy_to_rows(&pixels, &mut picture, WIDTH as usize)?;
    Ok(picture)
}

/// Calls `work` with every item, on several threads.
fn for_each<T>(threads: usize, items: impl Iterator<Item = T> + Send, work: impl Fn(T) + Sync) {
    let items = Mutex::new(items);
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let item = items.lock().expect("nobody panics").next();
                    let Some(item) = item else { break };
                    work(item);
                }
            });
        }
    });
}
