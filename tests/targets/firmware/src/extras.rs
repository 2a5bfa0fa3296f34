//! The draw of `lib.rs` with one thing exchanged at a time: what each costs in flash, and a pixel.

use halfplane::glam::{Vec3, Vec4};
use halfplane::{
    CompareOp, DepthState, Flat, Fragment, Grid, NoPerspective, Primitives, ProjectedVertex, Rasterizer,
    Record, Rect, Statistics, Surface, Viewport, pack_rgb565,
};

/// Pixels along a side of the frame.
const SIZE: u16 = 96;
const PIXELS: usize = SIZE as usize * SIZE as usize;
const TILE: u16 = 32;
const TILES: usize = (SIZE as usize / TILE as usize).pow(2);

/// All that any of the draws needs.
pub struct Memory {
    color: [u16; PIXELS],
    depth: [u16; PIXELS],
    depth_f32: [f32; PIXELS],
    vertices: [ProjectedVertex; 16],
    records: [Record<Vec3>; 16],
    bins: [u32; Grid::bin_memory(TILES, 16 * TILES)],
}

impl Memory {
    pub const fn new() -> Self {
        Self {
            color: [0; PIXELS],
            depth: [0; PIXELS],
            depth_f32: [0.0; PIXELS],
            vertices: [ProjectedVertex::BLANK; 16],
            records: [Record::blank(Vec3::ZERO); 16],
            bins: [0; Grid::bin_memory(TILES, 16 * TILES)],
        }
    }

    pub fn clear(&mut self) {
        self.color.fill(0);
        self.depth.fill(u16::MAX);
        self.depth_f32.fill(1.0);
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// A triangle list: positions, colours, indices.
pub type Mesh<'a> = (&'a [Vec4], &'a [Vec3], &'a [u16]);
pub type Draw = fn(&mut Memory, Mesh<'_>) -> Option<Statistics>;

/// The first is what the others are compared with.
pub const ALL: [(&str, Draw); 16] = [
    ("draw", base),
    ("shared_function", shared_function),
    ("depth_only", depth_only),
    ("no_depth", no_depth),
    ("depth_f32", depth_f32),
    ("run_time_compare", run_time_compare),
    ("no_perspective", no_perspective),
    ("flat", flat),
    ("no_varyings", no_varyings),
    ("derivatives", derivatives),
    ("discard", discard),
    ("blend", blend),
    ("project_first", project_first),
    ("prepare", prepare),
    ("bins", bins),
    ("two_closures", two_closures),
];

/// By its name, while compiling, so that a program holds this one alone.
pub const fn find(name: &str) -> Draw {
    let mut i = 0;
    while i < ALL.len() {
        if is_equal(ALL[i].0.as_bytes(), name.as_bytes()) {
            return ALL[i].1;
        }
        i += 1;
    }
    panic!("no such draw")
}

const fn is_equal(a: &[u8], b: &[u8]) -> bool {
    let mut i = 0;
    while i < a.len() && i < b.len() && a[i] == b[i] {
        i += 1;
    }
    i == a.len() && i == b.len()
}

fn rasterizer<V: halfplane::Varyings>() -> Option<Rasterizer<V>> {
    Some(Rasterizer::new(Viewport::of_size(SIZE.into(), SIZE.into()).ok()?))
}

fn surface<'a, D: halfplane::DepthFormat>(
    color: &'a mut [u16],
    depth: &'a mut [D],
) -> Option<Surface<&'a mut [u16], &'a mut [D]>> {
    Surface::new(color, depth, SIZE.into(), SIZE.into()).ok()
}

/// A closure for each draw: by a function that several share, a pixel takes longer (see `shared_function`).
macro_rules! shade {
    () => {
        |fragment: Fragment<'_, Vec3>| pack_rgb565(fragment.varyings())
    };
}

fn base(memory: &mut Memory, (positions, colors, indices): Mesh<'_>) -> Option<Statistics> {
    let mut target = surface(&mut memory.color, &mut memory.depth)?;
    rasterizer()?.draw(&mut target, Primitives::list().indexed(indices), positions, colors, shade!()).ok()
}

#[inline(always)]
fn shade(fragment: Fragment<'_, Vec3>) -> u16 {
    pack_rgb565(fragment.varyings())
}

fn shared_function(memory: &mut Memory, (positions, colors, indices): Mesh<'_>) -> Option<Statistics> {
    let mut target = surface(&mut memory.color, &mut memory.depth)?;
    let rasterizer = rasterizer()?;
    let list = Primitives::list().indexed(indices);
    // Never drawn, as far as a measurement goes; but it is there.
    if core::hint::black_box(false) {
        rasterizer.draw(&mut target, list, positions, [Vec3::ZERO; 3], shade).ok()?;
    }
    rasterizer.draw(&mut target, list, positions, colors, shade).ok()
}

fn depth_only(memory: &mut Memory, (positions, _, indices): Mesh<'_>) -> Option<Statistics> {
    let mut target = Surface::depth_only(&mut memory.depth, SIZE.into(), SIZE.into()).ok()?;
    rasterizer::<()>()?.draw_depth(&mut target, Primitives::list().indexed(indices), positions).ok()
}

fn no_depth(memory: &mut Memory, (positions, colors, indices): Mesh<'_>) -> Option<Statistics> {
    let mut target = Surface::color_only(&mut memory.color, SIZE.into(), SIZE.into()).ok()?;
    rasterizer()?.draw(&mut target, Primitives::list().indexed(indices), positions, colors, shade!()).ok()
}

fn depth_f32(memory: &mut Memory, (positions, colors, indices): Mesh<'_>) -> Option<Statistics> {
    let mut target = surface(&mut memory.color, &mut memory.depth_f32)?;
    rasterizer()?.draw(&mut target, Primitives::list().indexed(indices), positions, colors, shade!()).ok()
}

fn run_time_compare(memory: &mut Memory, (positions, colors, indices): Mesh<'_>) -> Option<Statistics> {
    let mut target = surface(&mut memory.color, &mut memory.depth)?;
    let test = core::hint::black_box(DepthState { compare: CompareOp::Less, write: true });
    let rasterizer = rasterizer()?.with_depth_test(test);
    rasterizer.draw(&mut target, Primitives::list().indexed(indices), positions, colors, shade!()).ok()
}

fn no_perspective(memory: &mut Memory, (positions, colors, indices): Mesh<'_>) -> Option<Statistics> {
    let mut target = surface(&mut memory.color, &mut memory.depth)?;
    let colors = halfplane::Attribute::field(colors, |&color| NoPerspective(color));
    let shade = |fragment: Fragment<'_, NoPerspective<Vec3>>| pack_rgb565(fragment.varyings().0);
    rasterizer()?.draw(&mut target, Primitives::list().indexed(indices), positions, colors, shade).ok()
}

/// A colour for each triangle, packed before it is drawn.
fn flat(memory: &mut Memory, (positions, colors, indices): Mesh<'_>) -> Option<Statistics> {
    let mut target = surface(&mut memory.color, &mut memory.depth)?;
    let colors = halfplane::Attribute::field(colors, |&color| Flat(pack_rgb565(color)));
    let shade = |fragment: Fragment<'_, Flat<u16>>| fragment.varyings().0;
    rasterizer()?.draw(&mut target, Primitives::list().indexed(indices), positions, colors, shade).ok()
}

fn no_varyings(memory: &mut Memory, (positions, _, indices): Mesh<'_>) -> Option<Statistics> {
    let mut target = surface(&mut memory.color, &mut memory.depth)?;
    rasterizer()?.draw(&mut target, Primitives::list().indexed(indices), positions, (), |_| 0xffffu16).ok()
}

fn derivatives(memory: &mut Memory, (positions, colors, indices): Mesh<'_>) -> Option<Statistics> {
    let mut target = surface(&mut memory.color, &mut memory.depth)?;
    let shade = |fragment: Fragment<'_, Vec3>| {
        let change = fragment.varyings_dx().abs() + fragment.varyings_dy().abs();
        pack_rgb565(fragment.varyings() * (1.0 - change.x))
    };
    rasterizer()?.draw(&mut target, Primitives::list().indexed(indices), positions, colors, shade).ok()
}

fn discard(memory: &mut Memory, (positions, colors, indices): Mesh<'_>) -> Option<Statistics> {
    let mut target = surface(&mut memory.color, &mut memory.depth)?;
    let shade = |fragment: Fragment<'_, Vec3>| {
        let color = fragment.varyings();
        (color.x >= 0.0).then(|| pack_rgb565(color))
    };
    rasterizer()?.draw(&mut target, Primitives::list().indexed(indices), positions, colors, shade).ok()
}

fn blend(memory: &mut Memory, (positions, colors, indices): Mesh<'_>) -> Option<Statistics> {
    let mut target = surface(&mut memory.color, &mut memory.depth)?;
    // Half of each: what RGB565 makes easy.
    let shade = |fragment: Fragment<'_, Vec3>, below: u16| {
        (pack_rgb565(fragment.varyings()) >> 1 & 0x7bef) + (below >> 1 & 0x7bef)
    };
    rasterizer()?.draw_over(&mut target, Primitives::list().indexed(indices), positions, colors, shade).ok()
}

fn project_first(memory: &mut Memory, (positions, colors, indices): Mesh<'_>) -> Option<Statistics> {
    let mut target = surface(&mut memory.color, &mut memory.depth)?;
    let rasterizer = rasterizer()?;
    let vertices = rasterizer.project(positions, &mut memory.vertices).ok()?;
    rasterizer.draw(&mut target, Primitives::list().indexed(indices), vertices, colors, shade!()).ok()
}

/// The frame at once, from records.
fn prepare(memory: &mut Memory, (positions, colors, indices): Mesh<'_>) -> Option<Statistics> {
    let rasterizer = rasterizer()?;
    let vertices = rasterizer.project(positions, &mut memory.vertices).ok()?;
    let (frame, list) = (Rect::of_size(SIZE.into(), SIZE.into()), Primitives::list().indexed(indices));
    let mut preparation = rasterizer.prepare(frame, list, vertices, colors).ok()?;
    let mut target = surface(&mut memory.color, &mut memory.depth)?;
    let mut drawn = Statistics::default();
    while let Some(batch) = preparation.fill(&mut memory.records).ok()? {
        drawn += rasterizer.draw_prepared(&mut target, batch, shade!());
    }
    drawn += preparation.statistics();
    Some(drawn)
}

/// The frame in tiles, from records, by bins.
fn bins(memory: &mut Memory, (positions, colors, indices): Mesh<'_>) -> Option<Statistics> {
    let rasterizer = rasterizer()?;
    let vertices = rasterizer.project(positions, &mut memory.vertices).ok()?;
    let (frame, list) = (Rect::of_size(SIZE.into(), SIZE.into()), Primitives::list().indexed(indices));
    let grid = Grid::new(frame, TILE.into(), TILE.into()).ok()?;
    let mut preparation = rasterizer.prepare(frame, list, vertices, colors).ok()?;
    let mut drawn = Statistics::default();
    while let Some(batch) = preparation.fill(&mut memory.records).ok()? {
        let bins = rasterizer.bin(&grid, batch, &mut memory.bins).ok()?;
        let tiles = grid.surfaces(&mut memory.color[..], &mut memory.depth[..]).ok()?;
        for (index, mut tile) in tiles.enumerate() {
            drawn += rasterizer.draw_prepared(&mut tile, bins.tile(index), shade!());
        }
    }
    drawn += preparation.statistics();
    Some(drawn)
}

/// Both, one after the other: each closure is a draw of its own to the compiler.
fn two_closures(memory: &mut Memory, mesh: Mesh<'_>) -> Option<Statistics> {
    base(memory, mesh)?;
    memory.depth.fill(u16::MAX);
    no_varyings(memory, mesh)
}

/// Reads the frame ahead. (None of `ALL`: nobody needs it where there is no cache. But it must not panic either.)
pub fn prefetch(memory: &mut Memory) -> Option<()> {
    rasterizer::<()>()?.prefetch(&mut surface(&mut memory.color, &mut memory.depth)?);
    Some(())
}

/// How a triangle that lies beside a tile gets there.
#[derive(Clone, Copy, Debug)]
pub enum Beside {
    Positions,
    Projected,
    Records,
}

/// Draws triangles into the last tile of the frame, where they should not be. `count` runs around what is measured.
pub fn beside<R>(
    memory: &mut Memory,
    (positions, colors, indices): Mesh<'_>,
    what: Beside,
    count: impl FnOnce(&mut dyn FnMut()) -> R,
) -> Option<R> {
    let rasterizer = rasterizer()?;
    let list = Primitives::list().indexed(indices);
    let vertices = rasterizer.project(positions, &mut memory.vertices).ok()?;
    let frame = Rect::of_size(SIZE.into(), SIZE.into());
    let mut preparation = rasterizer.prepare(frame, list, vertices, colors).ok()?;
    let records = preparation.fill(&mut memory.records).ok()??;
    let area = Grid::new(frame, TILE.into(), TILE.into()).ok()?.tile(TILES - 1)?;
    let mut tile =
        Surface::with_planes(&mut memory.color[..], &mut memory.depth[..], area, TILE.into()).ok()?;
    let mut drawn = None;
    let result = count(&mut || {
        drawn = match what {
            Beside::Positions => rasterizer.draw(&mut tile, list, positions, colors, shade!()).ok(),
            Beside::Projected => rasterizer.draw(&mut tile, list, vertices, colors, shade!()).ok(),
            Beside::Records => Some(rasterizer.draw_prepared(&mut tile, records, shade!())),
        }
    });
    (drawn?.fragments == 0 && records.len() == indices.len() / 3).then_some(result)
}
