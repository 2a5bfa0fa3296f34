//! All cores on one frame with rayon: the geometry half in parts of the mesh, the fragment half in tiles of the frame. The
//! same bits for any number of threads and any size of tiles.
//!
//! `parallel` does the same with the standard library alone.

mod support;

use core::error::Error;
use halfplane::{Bins, Grid, Primitives, Projected, ProjectedVertex, Record, Rect};
use rayon::prelude::*;
use support::{cuts, image, scene};

const WIDTH: u32 = 1280;
const HEIGHT: u32 = 960;

/// How many triangles or vertices a task has: their records fit into a core's own cache.
///
/// And a task is one of these chunks, or one tile (`with_max_len(1)`): left to itself, rayon cuts a list into a few long
/// parts, and a thread that has finished its own finds nothing to take from one that was late.
const CHUNK: usize = 2048;

fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    let scene = scene::Scene::teapot(48, WIDTH as f32 / HEIGHT as f32);
    println!("{} triangles", scene.indices.len() / 3);
    // A program has one pool, not one a frame. But `parallel` starts its threads for each frame, too.
    let picture = cuts::compare((WIDTH, HEIGHT), |threads, tile| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        pool.install(|| draw(&scene, tile))
    })?;
    image::write_png(&image::output_path("parallel_rayon"), WIDTH, HEIGHT, &picture)?;
    Ok(())
}

/// Draws a frame with the threads of the pool that it is called in.
fn draw(scene: &scene::Scene, tile: (u32, u32)) -> Result<Vec<u32>, Box<dyn Error + Send + Sync>> {
    let frame = Rect::of_size(WIDTH, HEIGHT);
    let grid = Grid::new(frame, tile.0, tile.1)?;
    let rasterizer = scene.rasterizer(WIDTH, HEIGHT)?;
    let primitives = Primitives::list().indexed(&scene.indices);
    let triangles = primitives.triangle_count(scene.positions.len());

    // Vertices, each once.
    let mut room = vec![ProjectedVertex::default(); scene.positions.len()];
    room.par_chunks_mut(CHUNK)
        .zip(scene.positions.par_chunks(CHUNK))
        .with_max_len(1)
        .try_for_each(|(room, positions)| rasterizer.project(positions, room).map(drop))?;
    let vertices = Projected::new(&room, &scene.positions[..])?;

    // Triangles: records, and which tiles they touch. A triangle makes one record at most, so all of a chunk fit.
    let mut records = vec![Record::default(); triangles];
    let memory_len = Grid::bin_memory(grid.len(), grid.len() + 2 * CHUNK);
    let mut memory = vec![0; triangles.div_ceil(CHUNK) * memory_len];
    let bins: Vec<Bins<'_, '_, _>> = records
        .par_chunks_mut(CHUNK)
        .zip(memory.par_chunks_mut(memory_len))
        .enumerate()
        .with_max_len(1)
        .map(|(chunk, (records, memory))| {
            let part = primitives.part(chunk * CHUNK, (chunk + 1) * CHUNK);
            let mut preparation = rasterizer.prepare(frame, part, vertices, &scene.values[..])?;
            let batch = preparation.fill(records)?.unwrap_or_default();
            Ok(rasterizer.bin(&grid, batch, memory)?)
        })
        .collect::<Result<_, Box<dyn Error + Send + Sync>>>()?;

    // Tiles: each has its own memory, and its records in the order of the mesh. Those for which a chunk's bins had no
    // room are drawn after those in them, so that nothing changes but the time that it takes.
    let mut pixels = vec![scene::BACKGROUND; grid.len() * grid.tile_len()];
    let mut depth = vec![1.0f32; grid.len() * grid.tile_len()];
    let tiles: Vec<_> = grid.surfaces(&mut pixels[..], &mut depth[..])?.collect();
    tiles.into_par_iter().enumerate().with_max_len(1).for_each(|(index, mut tile)| {
        let records = bins.iter().flat_map(|bins| bins.tile(index).chain(bins.rest()));
        rasterizer.draw_prepared(&mut tile, records, |fragment| scene::color(fragment.varyings()));
    });
    let mut picture = vec![0; WIDTH as usize * HEIGHT as usize];
    grid.copy_to_rows(&pixels, &mut picture, WIDTH as usize)?;
    Ok(picture)
}
