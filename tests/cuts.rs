//! The law that the picture does not depend on how the frame is cut: geometry and fragments apart, any number of records at
//! a time, bins, tiles of any size, any number of threads. Every number that a fragment tells is compared bit by bit with
//! the direct draw's, and so is the order of fragments in a tile.

mod common;

use core::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Mutex;

use common::{Frame, Mixed, Nowhere, Random, Record as Told, config, mixed, records as told};
use glam::Vec4;
use halfplane::{
    Absent, Always, BinError, CullMode, DepthBias, DepthClip, DrawError, Flat, Fragment, FrontFace, Grid,
    NoPerspective, Primitives, Projected, ProjectedVertex, ProvokingVertex, Rasterizer, Record, Rect,
    Statistics, Surface, SurfaceError,
};
use proptest::prelude::*;

const FRAME: Frame = Frame::new(48, 40);
const BLANK: Record<Mixed> = Record::blank(([0.0; 2], NoPerspective(0.0), Flat(0)));

/// Vertices of triangles of all sizes, some of which are clipped, and indices of them, some of which restart.
struct Scene {
    positions: Vec<Vec4>,
    values: Vec<Mixed>,
    indices: Vec<u32>,
    kind: usize,
}

impl Scene {
    fn new(random: &mut Random) -> Self {
        let (positions, values) = FRAME.triangles(random);
        let last = i32::try_from(positions.len()).expect("few") - 1;
        let indices = (0..random.between(3, 24))
            .map(
                |_| if random.between(0, 6) == 0 { u32::MAX } else { random.between(0, last).unsigned_abs() },
            )
            .collect();
        Self { positions, values, indices, kind: random.choose(&[0, 0, 0, 1, 2, 3, 4, 5]) }
    }

    fn primitives(&self) -> Primitives<'_> {
        let kind = [Primitives::list(), Primitives::strip(), Primitives::fan()][self.kind % 3];
        if self.kind < 3 { kind } else { kind.indexed(&self.indices).with_restart() }
    }
}

/// Any state that a fragment can tell from another.
fn rasterizer(random: &mut Random) -> Rasterizer<Mixed> {
    let mut rasterizer = Rasterizer::new(FRAME.viewport());
    rasterizer.cull_mode = random.choose(&[CullMode::None, CullMode::None, CullMode::Front, CullMode::Back]);
    rasterizer.front_face = random.choose(&[FrontFace::CounterClockwise, FrontFace::Clockwise]);
    rasterizer.depth_clip = random.choose(&[DepthClip::Clip, DepthClip::Clamp]);
    rasterizer.provoking_vertex = random.choose(&[ProvokingVertex::First, ProvokingVertex::Last]);
    rasterizer.depth_bias = random
        .choose(&[DepthBias::default(), DepthBias { constant: 3.0, slope: 1.5, ..DepthBias::default() }]);
    if random.between(0, 3) == 0 {
        rasterizer.scissor = Some(Rect { x: random.between(-9, 30), y: 5, width: 20, height: 20 });
    }
    rasterizer
}

/// Tiles of any size over the frame, or over more or less than it.
fn grid(random: &mut Random) -> Grid {
    let area = random.choose(&[FRAME.area(), FRAME.area(), Rect { x: -7, y: 3, width: 60, height: 30 }]);
    let side = |random: &mut Random| {
        let most = random.choose(&[4, 16, 64]);
        random.between(1, most).unsigned_abs()
    };
    Grid::new(area, side(random), side(random)).expect("legal")
}

fn size(random: &mut Random) -> usize {
    random.choose(&[1, 1, 2, 3, 7, 100])
}

/// Statistics of the geometry half alone.
fn geometry_of(statistics: Statistics) -> Statistics {
    let mut geometry = statistics;
    (geometry.fragments, geometry.samples_passed) = (0, 0);
    geometry
}

/// An order-sensitive mix of everything that a fragment tells and the colour before.
fn shade(fragment: &Fragment<'_, Mixed>, below: u32) -> u32 {
    let ([u, v], NoPerspective(n), Flat(flat)) = fragment.varyings();
    let mut hash = below.rotate_left(5).wrapping_mul(0x9e37_79b1) ^ flat ^ fragment.primitive_index();
    hash ^= u32::from(fragment.is_front_facing()) << 31;
    let (weights, barycentrics) = (fragment.weights(), fragment.barycentrics());
    for bits in [u, v, n].into_iter().chain(weights).chain(barycentrics).map(f32::to_bits) {
        hash = (hash.rotate_left(7) ^ bits).wrapping_mul(0x85eb_ca6b);
    }
    hash
}

/// Colours and depths of the direct draw, over all of the frame in a grid's area.
fn direct(rasterizer: &Rasterizer<Mixed>, scene: &Scene, area: Rect) -> (Vec<u32>, Vec<u16>, Statistics) {
    let len = area.width as usize * area.height as usize;
    let (mut color, mut depth) = (vec![7u32; len], vec![u16::MAX; len]);
    let mut target =
        Surface::with_planes(&mut color[..], &mut depth[..], area, area.width as usize).expect("it fits");
    let (positions, values) = (&scene.positions[..], &scene.values[..]);
    let statistics = rasterizer
        .draw_over(&mut target, scene.primitives(), positions, values, |fragment, below| {
            shade(&fragment, below)
        })
        .expect("legal input");
    (color, depth, statistics)
}

/// Draws what a grid shows into tile-linear memory, both halves by `threads` threads.
fn cut(
    rasterizer: &Rasterizer<Mixed>,
    scene: &Scene,
    grid: &Grid,
    random: &mut Random,
) -> (Vec<u32>, Vec<u16>, Statistics) {
    let threads = random.choose(&[1, 2, 3, 7, 16]);
    let len = grid.len() * grid.tile_len();
    let (mut color, mut depth) = (vec![7u32; len], vec![u16::MAX; len]);
    let tiles: Vec<_> = grid.surfaces(&mut color[..], &mut depth[..]).expect("it fits").collect();
    let tiles: Vec<Mutex<_>> = tiles.into_iter().map(Mutex::new).collect();

    // Some threads project, each its part of the vertices.
    let mut room = vec![ProjectedVertex::default(); scene.positions.len()];
    let part = scene.positions.len().div_ceil(threads);
    std::thread::scope(|scope| {
        for (positions, room) in scene.positions.chunks(part).zip(room.chunks_mut(part)) {
            scope.spawn(move || rasterizer.project(positions, room).map(drop));
        }
    });
    let vertices = Projected::new(&room, &scene.positions[..]).expect("as many");

    // Each thread prepares a part of the triangles, with memory of its own for records.
    let primitives = scene.primitives();
    let count = primitives.triangle_count(scene.positions.len());
    let parts = count.div_ceil(threads).max(1);
    let mut preparations: Vec<_> = (0..threads)
        .map(|thread| {
            let part = primitives.part(thread * parts, (thread + 1) * parts);
            let preparation = rasterizer.prepare(grid.area(), part, vertices, &scene.values[..]);
            (preparation.expect("legal input"), vec![BLANK; size(random)])
        })
        .collect();
    let entries = grid.len() + size(random) - 1;
    let mut statistics = Statistics::default();
    // Parts in order; of each, as much at a time as there is memory for.
    for (preparation, records) in &mut preparations {
        let mut memory = vec![0; Grid::bin_memory(grid.len(), entries)];
        while let Some(mut batch) = preparation.fill(records).expect("there is room") {
            while !batch.is_empty() {
                let bins = rasterizer.bin(grid, batch, &mut memory).expect("enough for one record");
                assert!(!bins.is_empty(), "it goes on");
                let next = AtomicUsize::new(0);
                let sum = Mutex::new(&mut statistics);
                std::thread::scope(|scope| {
                    for _ in 0..threads {
                        scope.spawn(|| {
                            loop {
                                let index = next.fetch_add(1, Ordering::Relaxed);
                                let Some(tile) = tiles.get(index) else { break };
                                let mut tile = tile.lock().expect("nobody panics");
                                let statistics = rasterizer.draw_prepared_over(
                                    &mut *tile,
                                    bins.tile(index),
                                    |fragment, below| shade(&fragment, below),
                                );
                                **sum.lock().expect("nobody panics") += statistics;
                            }
                        });
                    }
                });
                batch = bins.rest();
            }
        }
        statistics += preparation.statistics();
    }
    drop(tiles);
    let Rect { width, height, .. } = grid.area();
    let mut frame = (vec![0; (width * height) as usize], vec![0; (width * height) as usize]);
    grid.copy_to_rows(&color, &mut frame.0, width as usize).expect("it fits");
    grid.copy_to_rows(&depth, &mut frame.1, width as usize).expect("it fits");
    (frame.0, frame.1, statistics)
}

proptest! {
    #![proptest_config(config(200))]

    /// Memory after a draw in tiles and in threads, from records in batches of one and more and bins that overflow.
    #[test]
    fn memory_does_not_depend_on_tiles_threads_and_room(seed in any::<u64>()) {
        let random = &mut Random::new(seed);
        let (scene, rasterizer, grid) = (Scene::new(random), rasterizer(random), grid(random));
        let expected = direct(&rasterizer, &scene, grid.area());
        prop_assert_eq!(cut(&rasterizer, &scene, &grid, random), expected, "{:?}", grid);
    }

    /// The order and every number of the fragments in each tile, and nothing else in it.
    #[test]
    fn fragments_do_not_depend_on_tiles_and_room(seed in any::<u64>()) {
        let random = &mut Random::new(seed);
        let (scene, rasterizer, grid) = (Scene::new(random), rasterizer(random), grid(random));
        let rasterizer = rasterizer.with_depth_test(Always);
        let (positions, values) = (&scene.positions[..], &scene.values[..]);
        let whole = told(&rasterizer, &mut Nowhere::new(grid.area()), scene.primitives(), positions, values);

        let mut tiles = vec![Vec::new(); grid.len()];
        let mut records = vec![BLANK; size(random)];
        let mut memory = vec![0; Grid::bin_memory(grid.len(), grid.len() + size(random))];
        let mut preparation =
            rasterizer.prepare(grid.area(), scene.primitives(), positions, values).expect("legal input");
        while let Some(mut batch) = preparation.fill(&mut records).expect("there is room") {
            while !batch.is_empty() {
                let bins = rasterizer.bin(&grid, batch, &mut memory).expect("enough for one record");
                for (index, (area, told)) in grid.tiles().zip(&mut tiles).enumerate() {
                    let tile = &mut Nowhere::new(area);
                    let mut draw = |records: &mut dyn Iterator<Item = &Record<Mixed>>| {
                        let mut all = Vec::new();
                        rasterizer.draw_prepared(tile, records, |fragment| all.push(Told::of(&fragment)));
                        all
                    };
                    let binned = draw(&mut bins.tile(index));
                    prop_assert_eq!(
                        &binned, &draw(&mut batch[..bins.len()].iter()), "bins lose nothing: {:?}", area
                    );
                    told.extend(binned);
                }
                batch = bins.rest();
            }
        }
        for (area, told) in grid.tiles().zip(&tiles) {
            let expected: Vec<Told> = whole.iter().filter(|told| area.contains(told.x, told.y)).copied().collect();
            prop_assert_eq!(told, &expected, "{:?} of {:?}", area, grid);
        }
    }

    /// A triangle that touches no sample of a tile may be in its bin only if no edge excludes all of the tile.
    #[test]
    fn bins_are_exact(seed in any::<u64>()) {
        let random = &mut Random::new(seed);
        let (scene, grid) = (Scene::new(random), grid(random));
        let rasterizer = Rasterizer::<Mixed>::new(FRAME.viewport());
        let (positions, values) = (&scene.positions[..], &scene.values[..]);
        let batch = &prepared(grid.area(), scene.primitives(), positions, values)[..];
        let mut memory = vec![0; Grid::bin_memory(grid.len(), grid.len() * (batch.len() + 1))];
        let bins = rasterizer.bin(&grid, batch, &mut memory).expect("enough");
        prop_assert!(bins.rest().is_empty() && bins.len() == batch.len(), "all fit");
        let mut entries = 0;
        for (index, area) in grid.tiles().enumerate() {
            let seen = area.intersection(FRAME.area());
            let numbers: Vec<u32> = bins.tile(index).map(Record::primitive_index).collect();
            prop_assert!(numbers.is_sorted(), "submission order: {:?}", numbers);
            entries += numbers.len();
            for record in batch {
                let Some(setup) = record.setup() else { continue };
                // Where the bounding box lies in one tile, the edges are not asked.
                let is_alone = grid.tiles().filter(|tile| {
                    !tile.intersection(setup.bounds()).intersection(FRAME.area()).is_empty()
                }).count() == 1;
                let is_touched = !setup.bounds().intersection(seen).is_empty()
                    && (is_alone || setup.coverage(area) != halfplane::Coverage::None);
                prop_assert_eq!(
                    numbers.contains(&record.primitive_index()), is_touched, "{:?} in {:?}", setup, area
                );
            }
        }
        prop_assert_eq!(bins.entries(), entries, "entries");
    }

    /// Parts one after the other are the whole, direct draws too, down to the statistics.
    #[test]
    fn parts_of_primitives_are_the_whole(seed in any::<u64>()) {
        let random = &mut Random::new(seed);
        let (scene, rasterizer) = (Scene::new(random), rasterizer(random));
        let (positions, values) = (&scene.positions[..], &scene.values[..]);
        let whole = told(&rasterizer, &mut Nowhere::new(FRAME.area()), scene.primitives(), positions, values);
        let (.., statistics) = direct(&rasterizer, &scene, FRAME.area());
        let (mut parts, mut sum) = (Vec::new(), Statistics::default());
        let count = scene.primitives().triangle_count(positions.len());
        prop_assert_eq!(statistics.primitives, count as u64, "count");
        let mut first = 0;
        while first < count {
            let end = first + size(random);
            let part = scene.primitives().part(first, end);
            parts.extend(told(&rasterizer, &mut Nowhere::new(FRAME.area()), part, positions, values));
            let mut preparation =
                rasterizer.prepare(FRAME.area(), part, positions, values).expect("legal input");
            while preparation.fill(&mut [BLANK]).expect("there is room").is_some() {}
            sum += preparation.statistics();
            first = end;
        }
        prop_assert_eq!(parts, whole, "fragments");
        prop_assert_eq!(sum, geometry_of(statistics), "statistics");
    }
}

fn two_triangles() -> (Vec<Vec4>, Vec<Mixed>) {
    let positions = [[0.0, 0.0], [0.0, 40.0], [48.0, 0.0], [48.0, 0.0], [0.0, 40.0], [48.0, 40.0]];
    (positions.map(|p| FRAME.at(p)).to_vec(), vec![mixed(0.0, 1.0, 2); 6])
}

/// The records of a whole scene.
fn prepared(
    area: Rect,
    primitives: Primitives<'_>,
    positions: &[Vec4],
    values: &[Mixed],
) -> Vec<Record<Mixed>> {
    let rasterizer = Rasterizer::<Mixed>::new(FRAME.viewport());
    let mut preparation = rasterizer.prepare(area, primitives, positions, values).expect("legal input");
    let mut records = vec![BLANK; 100];
    let len = preparation.fill(&mut records).expect("there is room").map_or(0, <[_]>::len);
    records.truncate(len);
    records
}

#[test]
fn no_room_for_records_is_an_error() {
    let (positions, values) = two_triangles();
    let rasterizer = Rasterizer::<Mixed>::new(FRAME.viewport());
    let mut preparation =
        rasterizer.prepare(FRAME.area(), Primitives::list(), &positions[..], &values[..]).expect("legal");
    let error = preparation.fill(&mut []).expect_err("no room");
    assert_eq!(error, DrawError::NoRecords, "not in silence");
    assert_eq!(error.to_string(), "0 records of memory cannot hold any triangle", "told");
    // Nothing was lost.
    let mut records = [BLANK; 3];
    assert_eq!(
        preparation.fill(&mut records).expect("room").map(<[_]>::len),
        Some(2),
        "both are still there"
    );
    assert_eq!(preparation.fill(&mut records).expect("room").map(<[_]>::len), None, "and no more");
    assert_eq!(preparation.fill(&mut records).expect("room").map(<[_]>::len), None, "ever");
}

#[test]
fn grids_as_wide_as_everything_are_copied_to_rows() {
    let area = Rect { x: -16_384, y: 16_382, width: 32_768, height: 2 };
    let grid = Grid::new(area, 48, 2).expect("legal");
    let tiles: Vec<u32> = (0..).take(grid.len() * grid.tile_len()).collect();
    let mut frame = vec![0; 32_768 * 2];
    grid.copy_to_rows(&tiles, &mut frame, 32_768).expect("both are long enough");
    assert_eq!((frame[47], frame[48], frame[32_768 + 48]), (47, 96, 96 + 48), "the first two tiles");
    assert_eq!(frame[32_767], 96 * 682 + 31, "the last one is cut to 32 columns");
}

#[test]
fn scissors_are_those_of_each_draw() {
    let points = [[0.0, 0.0], [0.0, 40.0], [24.0, 40.0], [24.0, 0.0], [24.0, 40.0], [48.0, 40.0]];
    let (positions, values) = (points.map(|point| FRAME.at(point)), [mixed(0.0, 1.0, 2); 6]);
    let draw = |prepares: Option<Rect>, draws: Option<Rect>| {
        let mut rasterizer = Rasterizer::<Mixed>::new(FRAME.viewport());
        rasterizer.scissor = prepares;
        let mut preparation =
            rasterizer.prepare(FRAME.area(), Primitives::list(), &positions[..], &values[..]).expect("legal");
        let mut records = [BLANK; 4];
        let batch = preparation.fill(&mut records).expect("there is room").unwrap_or_default();
        rasterizer.scissor = draws;
        let mut counts = vec![0u8; FRAME.len()];
        let mut target = Surface::color_only(&mut counts, FRAME.width, FRAME.height).expect("it fits");
        rasterizer.draw_prepared_over(&mut target, batch, |_, count| count + 1).samples_passed
    };
    let corner = Rect { x: 0, y: 36, width: 4, height: 4 };
    assert_eq!((draw(None, None), draw(Some(corner), None)), (952, 952), "nothing is missing");
    assert_eq!((draw(None, Some(corner)), draw(Some(corner), Some(corner))), (16, 16), "nothing is too much");
}

#[test]
fn preparing_fails_as_drawing_does() {
    let (positions, values) = two_triangles();
    let rasterizer = Rasterizer::<Mixed>::new(FRAME.viewport());
    let prepare = |indices: &[u8], first, end, values: &[Mixed]| {
        let primitives = Primitives::list().indexed(indices).part(first, end);
        rasterizer.prepare(FRAME.area(), primitives, &positions[..], values).map(drop)
    };
    let wrong = DrawError::IndexOutOfRange { position: 4, index: 6, vertices: 6 };
    assert_eq!(prepare(&[0, 1, 2, 3, 6, 5], 0, 9, &values), Err(wrong), "an index");
    assert_eq!(prepare(&[0, 1, 2, 3, 6, 5], 1, 2, &values), Err(wrong), "in a part, with its position");
    assert_eq!(prepare(&[0, 1, 2, 3, 6, 5], 0, 1, &values), Ok(()), "in another part");
    let few = DrawError::TooFewVaryings { positions: 6, varyings: 5 };
    assert_eq!(prepare(&[0, 1, 2], 0, 1, &values[..5]), Err(few), "varyings");
    let error = Projected::new(&[ProjectedVertex::default(); 5], &positions[..]).map(drop);
    assert_eq!(error, Err(DrawError::TooFewProjected { positions: 6, room: 5 }), "vertices");
}

#[test]
fn bins_that_overflow_say_what_is_left() {
    let (positions, values) = two_triangles();
    let rasterizer = Rasterizer::<Mixed>::new(FRAME.viewport());
    let batch = &prepared(FRAME.area(), Primitives::list(), &positions, &values)[..];
    let grid = Grid::new(FRAME.area(), 16, 16).expect("legal");
    // 3 · 3 tiles, of which each triangle touches up to 7: too little for both, enough for one.
    let mut memory = [u32::MAX; Grid::bin_memory(9, 9)];
    let error = rasterizer.bin(&grid, batch, &mut memory[1..]).expect_err("17 < 18");
    assert_eq!(error, BinError::TooShort { len: 17, needed: 18 }, "might not hold one");
    assert_eq!(error.to_string(), "bins need 18 numbers of memory at least, not 17", "told");
    let bins = rasterizer.bin(&grid, batch, &mut memory).expect("enough for one");
    assert_eq!((bins.len(), bins.rest().len()), (1, 1), "the first, and the other is left");
    assert_eq!(bins.rest()[0].primitive_index(), 1, "in order");
    assert_eq!(bins.tile(9).count() + bins.tile(usize::MAX).count(), 0, "no such tile");
    let (first, rest) = (bins.entries(), bins.rest());
    let bins = rasterizer.bin(&grid, rest, &mut memory).expect("enough for one");
    assert!(bins.rest().is_empty() && bins.entries() <= 9 && first <= 9, "and then none is");
    let bins = rasterizer.bin(&grid, &[], &mut memory).expect("nothing to do");
    assert!(bins.is_empty() && grid.tiles().enumerate().all(|(i, _)| bins.tile(i).next().is_none()), "empty");
    // Slivers along the diagonal touch the tiles along it.
    let diagonal = [FRAME.at([0.0, 0.0]), FRAME.at([0.0, 0.5]), FRAME.at([48.0, 40.0])];
    let fine = Grid::new(FRAME.area(), 1, 1).expect("legal");
    let mut memory = vec![0; Grid::bin_memory(fine.len(), 9999)];
    let sliver = prepared(FRAME.area(), Primitives::list(), &diagonal, &values[..3]);
    let bins = rasterizer.bin(&fine, &sliver, &mut memory).expect("enough");
    assert!(bins.rest().is_empty() && bins.len() == 1, "it fits");
    assert!((10..100).contains(&bins.entries()), "{} of {} tiles", bins.entries(), fine.len());
}

#[test]
fn tiles_outside_of_the_frame_stay_empty_and_overlapping_ones_agree() {
    let (positions, values) = two_triangles();
    let rasterizer = Rasterizer::<Mixed>::new(FRAME.viewport());
    let batch = &prepared(FRAME.area(), Primitives::list(), &positions, &values)[..];
    assert_eq!(batch.len(), 2, "both are seen");
    for (x, y, width, height, expected) in [
        (0, 0, 48, 40, 48 * 40),
        (-30, -30, 29, 29, 0),
        (48, 0, 9, 9, 0),
        (-16_384, -16_384, 8, 8, 0),
        (16_376, 16_376, 8, 8, 0),
        (40, 30, 100, 100, 80),
        (39, 30, 1, 10, 10),
        (5, 5, 0, 7, 0),
    ] {
        let area = Rect { x, y, width, height };
        let len = width as usize * height as usize;
        let mut counts = vec![0u8; len];
        let mut tile =
            Surface::with_planes(&mut counts[..], Absent::default(), area, width as usize).expect("fits");
        let statistics = rasterizer.draw_prepared_over(&mut tile, batch, |_, count| count + 1);
        assert_eq!(statistics.samples_passed, expected, "{area:?}");
        for (i, &count) in (0u32..).zip(&counts) {
            let (x, y) = (x.saturating_add_unsigned(i % width), y.saturating_add_unsigned(i / width));
            assert_eq!(count, u8::from(FRAME.area().contains(x, y)), "{area:?} ({x}, {y})");
        }
    }
    let outside = Rect { x: 16_380, y: 0, width: 8, height: 8 };
    let error = Surface::with_planes(&mut [0u8; 64][..], Absent::default(), outside, 8).expect_err("too far");
    assert_eq!(error, SurfaceError::OutOfRange { area: outside }, "tiles where nothing is");
    assert!(Grid::new(outside, 8, 8).is_err(), "and grids");
    // A grid beside the frame has empty bins.
    let beside = Grid::new(Rect { x: 100, y: 100, width: 32, height: 32 }, 8, 8).expect("legal");
    let bins = rasterizer.bin(&beside, batch, &mut [0; 64]).map(|bins| (bins.len(), bins.entries()));
    assert_eq!(bins, Ok((2, 0)), "seen, and nowhere");
}

#[test]
fn blank_records_draw_nothing() {
    let rasterizer = Rasterizer::<Mixed>::new(FRAME.viewport());
    let mut target = Nowhere::new(FRAME.area());
    assert_eq!(rasterizer.draw_prepared(&mut target, &[BLANK; 4], |_| ()), Statistics::default(), "nothing");
    let grid = Grid::new(FRAME.area(), 8, 8).expect("legal");
    let bins = rasterizer.bin(&grid, &[BLANK; 4], &mut [0; 99]).map(|bins| (bins.len(), bins.entries()));
    assert_eq!(bins, Ok((4, 0)), "nor are they anywhere");
    assert_eq!((BLANK.primitive_index(), BLANK.setup().is_none()), (0, true), "nor anything");
}

#[test]
fn records_end_where_an_iterator_first_does() {
    let (positions, values) = two_triangles();
    let records = prepared(FRAME.area(), Primitives::list(), &positions, &values);
    let rasterizer = Rasterizer::<Mixed>::new(FRAME.viewport());
    let draw = |lengths: &[usize]| {
        // So many, then none, then more again.
        let mut parts = lengths.iter().flat_map(|&len| (0..len).map(Some).chain([None]));
        let iterator = core::iter::from_fn(|| parts.next().flatten().map(|i| &records[i % records.len()]));
        let mut counts = vec![0u8; FRAME.len()];
        let mut target = Surface::color_only(&mut counts, FRAME.width, FRAME.height).expect("it fits");
        rasterizer.draw_prepared_over(&mut target, iterator, |_, count| count + 1).samples_passed
    };
    let each = u64::from(FRAME.width * FRAME.height) / 2;
    assert_eq!((draw(&[2, 5]), draw(&[64, 1]), draw(&[0, 1])), (2 * each, 64 * each, 0), "and not later");
    assert_eq!(draw(&[130]), 130 * each, "nor earlier");
}
