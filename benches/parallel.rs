//! Both halves of a draw in threads: `parallel/<stage>/<workload>/<threads>x<tiles>`.
//!
//! * `direct`: one draw call on one thread, for comparison.
//! * `geometry`: project, prepare, bin. `fragments`: draw the bins into tiles. `both`: one after the other.
//!
//! Whoever measures a ratio of threads should look at the least times of several runs: two threads on a machine that
//! does something else as well are not two threads.

#[path = "workloads/mod.rs"]
mod workloads;

use criterion::{Criterion, criterion_group, criterion_main};
use halfplane::{
    Bins, Computed, CullMode, Fragment, Grid, Primitives, Projected, ProjectedVertex, Rasterizer, Record,
    Rect, Surface, Varyings, Viewport,
};
use rayon::{ThreadPool, ThreadPoolBuilder, prelude::*};
use workloads::{CLEAR_COLOR, CLEAR_DEPTH, HEIGHT, Lit, Shading, WIDTH, Workload};

halfplane::varyings!(Lit { normal, uv });

/// Triangles or vertices a task.
///
/// And a task is one of these chunks, or one tile (`with_max_len(1)`): left to itself, rayon cuts a list into a few long
/// parts, and a thread that has finished its own finds nothing to take from one that was late.
const CHUNK: usize = 4096;

const FRAME: Rect = Rect::of_size(WIDTH, HEIGHT);

/// A workload's mesh, and all the memory that drawing it takes.
struct Frame<'w, V> {
    workload: &'w Workload,
    values: &'w [V],
    rasterizer: Rasterizer<V>,
    grid: Grid,
    room: Vec<ProjectedVertex>,
    records: Vec<Record<V>>,
    memory: Vec<u32>,
    color: Vec<u32>,
    depth: Vec<f32>,
}

impl<'w, V: Varyings + Default + Send + Sync> Frame<'w, V> {
    fn new(workload: &'w Workload, values: &'w [V], tile: (u32, u32)) -> Self {
        let mut rasterizer = Rasterizer::new(Viewport::of_size(WIDTH, HEIGHT).expect("a legal size"));
        rasterizer.cull_mode = if workload.cull_back { CullMode::Back } else { CullMode::None };
        let grid = Grid::new(FRAME, tile.0, tile.1).expect("legal tiles");
        let triangles = workload.indices.len() / 3;
        let len = grid.len() * grid.tile_len();
        Self {
            workload,
            values,
            rasterizer,
            grid,
            room: vec![ProjectedVertex::default(); workload.positions.len()],
            records: vec![Record::default(); triangles],
            memory: vec![0; triangles.div_ceil(CHUNK) * memory_len(&grid)],
            color: vec![CLEAR_COLOR; len],
            depth: vec![CLEAR_DEPTH; len],
        }
    }

    fn direct<R: Into<Option<u32>>>(&mut self, shade: impl Fn(Fragment<'_, V>) -> R) {
        let Self { workload, values, rasterizer, room, color, depth, .. } = self;
        let positions = Computed::new(workload.positions.len(), |i| {
            workload.transform * workload.positions[i].extend(1.0)
        });
        let vertices = rasterizer.project(positions, room).expect("there is room");
        let mut target =
            Surface::new(&mut color[..], &mut depth[..], WIDTH, HEIGHT).expect("they are as large");
        let primitives = Primitives::list().indexed(&workload.indices);
        rasterizer.draw(&mut target, primitives, vertices, *values, shade).expect("valid indices");
    }

    fn both<R: Into<Option<u32>>>(&mut self, shade: impl Fn(Fragment<'_, V>) -> R + Sync) {
        let Self { workload, values, rasterizer, grid, room, records, memory, color, depth } = self;
        let bins = geometry(workload, values, rasterizer, grid, room, records, memory);
        fragments(rasterizer, grid, &bins, color, depth, shade);
    }

    /// Colour and depth in rows.
    fn pixels(&self) -> (Vec<u32>, Vec<f32>) {
        let len = WIDTH as usize * HEIGHT as usize;
        let (mut color, mut depth) = (vec![0; len], vec![0.0; len]);
        self.grid.copy_to_rows(&self.color, &mut color, WIDTH as usize).expect("as large");
        self.grid.copy_to_rows(&self.depth, &mut depth, WIDTH as usize).expect("as large");
        (color, depth)
    }

    fn clear(&mut self) {
        self.color.fill(CLEAR_COLOR);
        self.depth.fill(CLEAR_DEPTH);
    }
}

fn memory_len(grid: &Grid) -> usize {
    Grid::bin_memory(grid.len(), grid.len() + 2 * CHUNK)
}

fn geometry<'a, V: Varyings + Send + Sync>(
    workload: &Workload,
    values: &[V],
    rasterizer: &Rasterizer<V>,
    grid: &Grid,
    room: &mut [ProjectedVertex],
    records: &'a mut [Record<V>],
    memory: &'a mut [u32],
) -> Vec<Bins<'a, 'a, V>> {
    let clip = |i: usize| workload.transform * workload.positions[i].extend(1.0);
    room.par_chunks_mut(CHUNK).enumerate().with_max_len(1).for_each(|(chunk, room)| {
        let positions = Computed::new(room.len(), |i| clip(chunk * CHUNK + i));
        rasterizer.project(positions, room).expect("there is room");
    });
    let vertices = Projected::new(room, Computed::new(workload.positions.len(), clip)).expect("as many");
    let primitives = Primitives::list().indexed(&workload.indices);
    records
        .par_chunks_mut(CHUNK)
        .zip(memory.par_chunks_mut(memory_len(grid)))
        .enumerate()
        .with_max_len(1)
        .map(|(chunk, (records, memory))| {
            let part = primitives.part(chunk * CHUNK, (chunk + 1) * CHUNK);
            let mut preparation = rasterizer.prepare(FRAME, part, vertices, values).expect("valid indices");
            let batch = preparation.fill(records).expect("there is room").unwrap_or_default();
            rasterizer.bin(grid, batch, memory).expect("long enough")
        })
        .collect()
}

fn fragments<V: Varyings + Send + Sync, R: Into<Option<u32>>>(
    rasterizer: &Rasterizer<V>,
    grid: &Grid,
    bins: &[Bins<'_, '_, V>],
    color: &mut [u32],
    depth: &mut [f32],
    shade: impl Fn(Fragment<'_, V>) -> R + Sync,
) {
    let tiles: Vec<_> = grid.surfaces(color, depth).expect("they are as large").collect();
    tiles.into_par_iter().enumerate().with_max_len(1).for_each(|(index, mut tile)| {
        let records = bins.iter().flat_map(|bins| bins.tile(index).chain(bins.rest()));
        rasterizer.draw_prepared(&mut tile, records, &shade);
    });
}

fn bench<V: Varyings + Default + Send + Sync, R: Into<Option<u32>>>(
    criterion: &mut Criterion,
    workload: &Workload,
    values: &[V],
    shade: impl Fn(Fragment<'_, V>) -> R + Sync + Copy,
) {
    let name = workload.name;
    let mut group = criterion.benchmark_group("parallel");
    group.sample_size(20);
    let mut whole = Frame::new(workload, values, (WIDTH, HEIGHT));
    whole.direct(shade);
    let expected = whole.pixels();
    group.bench_function(format!("direct/{name}"), |bencher| {
        bencher.iter(|| {
            whole.clear();
            whole.direct(shade);
        });
    });
    drop(whole);

    for tile in [(WIDTH, HEIGHT), (120, 68)] {
        let mut frame = Frame::new(workload, values, tile);
        let tiles = frame.grid.len();
        // One tile is not for two threads.
        for threads in if tiles == 1 { 1..=1 } else { 1..=2 } {
            let pool: ThreadPool =
                ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be had");
            frame.clear();
            pool.install(|| frame.both(shade));
            assert!(frame.pixels() == expected, "the picture of one draw call");
            let id = format!("{name}/{threads}x{tiles}");
            group.bench_function(format!("both/{id}"), |bencher| {
                bencher.iter(|| {
                    frame.clear();
                    pool.install(|| frame.both(shade));
                });
            });
            let Frame { workload, values, rasterizer, grid, room, records, memory, color, depth } =
                &mut frame;
            group.bench_function(format!("geometry/{id}"), |bencher| {
                bencher.iter(|| {
                    pool.install(|| geometry(workload, values, rasterizer, grid, room, records, memory).len())
                });
            });
            let bins = pool.install(|| geometry(workload, values, rasterizer, grid, room, records, memory));
            group.bench_function(format!("fragments/{id}"), |bencher| {
                bencher.iter(|| {
                    color.fill(CLEAR_COLOR);
                    depth.fill(CLEAR_DEPTH);
                    pool.install(|| fragments(rasterizer, grid, &bins, color, depth, shade));
                });
            });
            if threads == 1 {
                let (count, entries) =
                    bins.iter().fold((0, 0), |(n, e), bins| (n + bins.len(), e + bins.entries()));
                println!(
                    "{name} in {tiles} tiles: {} triangles, {count} records of {} bytes, {entries} entries of 4",
                    workload.indices.len() / 3,
                    size_of::<Record<V>>(),
                );
            }
        }
    }
}

fn benches(criterion: &mut Criterion) {
    for name in ["W1", "W3", "W4"] {
        let workload = Workload::new(name, || unreachable!("W6 alone has a teapot")).expect("it exists");
        match &workload.shading {
            Shading::Checker(uvs) => {
                bench(criterion, &workload, uvs, |fragment| workloads::checker(fragment.varyings()));
            }
            Shading::LitChecker(values) => {
                bench(criterion, &workload, values, |fragment| workloads::lit_checker(fragment.varyings()));
            }
            _ => unreachable!("no other shading in these"),
        }
    }
}

criterion_group!(parallel, benches);
criterion_main!(parallel);
