//! The scenes, and the hash of all that they leave.
//!
//! Geometry is made of integers and constants: nothing here rounds differently on another target. What a scene draws
//! passes through every room of the crate, and everything that a caller can see goes into its hash: each colour and depth
//! of the framebuffer, what the fragments tell about themselves, and the statistics.
//!
//! Frames are small (36 KiB with all planes), so that a microcontroller holds them.

#![expect(clippy::cast_possible_truncation, reason = "small numbers, and halves of longer ones")]

use halfplane::glam::{Vec2, Vec3, Vec4};
use halfplane::{
    Always, Attribute, ClipDepth, CompareOp, Computed, Coverage, CullMode, Depth24, DepthBias, DepthClip,
    DepthFormat, DepthState, DepthTest, DrawError, Equal, Flat, Fragment, FrontFace, Greater, GreaterOrEqual,
    Less, LessOrEqual, Never, NoPerspective, NotEqual, Primitives, ProjectedVertex, ProvokingVertex,
    Rasterizer, ReadOnly, Rect, Setup, Statistics, Surface, Topology, Varyings, Viewport, floor_to_i32,
    pack_bgra8, pack_rgb565, pack_rgba8, unpack_rgba8, wrap,
};

/// The size of the frame: no multiple of 8, so that blocks and vectors have a remainder.
pub const WIDTH: u32 = 55;
/// See [`WIDTH`].
pub const HEIGHT: u32 = 41;
const PIXELS: usize = WIDTH as usize * HEIGHT as usize;

/// Every plane that the scenes need, to be put wherever there is room.
#[derive(Debug)]
pub struct Memory {
    rgba: [u32; PIXELS],
    rgb565: [u16; PIXELS],
    depth: [f32; PIXELS],
    depth16: [u16; PIXELS],
    depth32: [u32; PIXELS],
}

impl Memory {
    /// All zero.
    pub const fn new() -> Self {
        Self {
            rgba: [0; PIXELS],
            rgb565: [0; PIXELS],
            depth: [0.0; PIXELS],
            depth16: [0; PIXELS],
            depth32: [0; PIXELS],
        }
    }

    /// Black, and as far away as can be.
    fn clear(&mut self) {
        self.rgba.fill(0);
        self.rgb565.fill(0);
        self.depth.fill(1.0);
        self.depth16.fill(u16::MAX);
        self.depth32.fill(u32::MAX);
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// FNV-1a with 64 bits, a 32-bit word at a time. Floats enter by their bits, every NaN as the same one: its sign and
/// payload are nobody's promise.
#[derive(Clone, Copy, Debug)]
pub struct Hash(u64);

impl Hash {
    const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    #[inline]
    fn word(&mut self, word: u32) {
        self.0 = (self.0 ^ u64::from(word)).wrapping_mul(0x0000_0100_0000_01b3);
    }

    #[inline]
    fn float(&mut self, x: f32) {
        self.word(if x.is_nan() { 0x7fc0_0000 } else { x.to_bits() });
    }

    fn long(&mut self, x: u64) {
        self.word((x & 0xffff_ffff) as u32);
        self.word((x >> 32) as u32);
    }

    fn floats(&mut self, numbers: impl IntoIterator<Item = f32>) {
        numbers.into_iter().for_each(|x| self.float(x));
    }

    fn words(&mut self, words: impl IntoIterator<Item = u32>) {
        words.into_iter().for_each(|word| self.word(word));
    }

    fn statistics(&mut self, result: Result<Statistics, DrawError>) {
        match result {
            Err(_) => self.word(u32::MAX),
            Ok(s) => {
                for count in [s.primitives, s.invalid, s.outside, s.clipped, s.culled, s.degenerate] {
                    self.long(count);
                }
                self.long(s.fragments);
                self.long(s.samples_passed);
            }
        }
    }

    /// Everything that a fragment tells, but its varyings.
    fn fragment<V: Varyings>(&mut self, fragment: &Fragment<'_, V>) {
        self.words([fragment.x() as u32, fragment.y() as u32, fragment.primitive_index()]);
        self.word(u32::from(fragment.is_front_facing()));
        self.floats([fragment.depth(), fragment.inv_w()]);
        self.floats(fragment.weights());
        self.floats(fragment.barycentrics());
    }

    fn all(&mut self, all: &All) {
        self.floats(all.color.to_array());
        self.floats(all.screen.0.to_array());
        self.word(all.material.0);
    }

    fn frame32(&mut self, memory: &Memory) {
        self.words(memory.rgba);
        self.floats(memory.depth);
    }

    fn frame16(&mut self, memory: &Memory) {
        self.words(memory.rgb565.map(u32::from));
        self.words(memory.depth16.map(u32::from));
    }
}

/// A scene: a name, and what draws it.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// What it is about.
    pub name: &'static str,
    draw: fn(&mut Memory, &mut Hash) -> Done,
}

/// `None` when something was refused that is right.
type Done = Option<()>;

impl Scene {
    /// Draws it, and hashes what can be seen of it. Zero when the scene itself is wrong.
    pub fn hash(&self, memory: &mut Memory) -> u64 {
        memory.clear();
        let mut hash = Hash::new();
        (self.draw)(memory, &mut hash).map_or(0, |()| hash.0)
    }
}

/// All of them.
pub const SCENES: [Scene; 30] = [
    Scene { name: "perspective/rgba8/f32", draw: perspective_rgba8_f32 },
    Scene { name: "perspective/rgb565/u16", draw: perspective_rgb565_u16 },
    Scene { name: "cut/whole", draw: cut_whole },
    Scene { name: "cut/tiles", draw: cut_tiles },
    Scene { name: "cut/bands", draw: cut_bands },
    Scene { name: "fragments", draw: fragments },
    Scene { name: "derivatives", draw: derivatives },
    Scene { name: "qualifiers", draw: qualifiers },
    Scene { name: "clip/near", draw: clip_near },
    Scene { name: "clip/guard_band", draw: clip_guard_band },
    Scene { name: "clip/depth_clamp", draw: clip_depth_clamp },
    Scene { name: "clip/negative_one_to_one", draw: clip_negative_one_to_one },
    Scene { name: "slivers", draw: slivers },
    Scene { name: "small", draw: small },
    Scene { name: "wide", draw: wide },
    Scene { name: "topologies", draw: topologies },
    Scene { name: "faces", draw: faces },
    Scene { name: "viewports", draw: viewports },
    Scene { name: "compare/f32", draw: compare_f32 },
    Scene { name: "compare/u16", draw: compare_u16 },
    Scene { name: "compare/depth24", draw: compare_depth24 },
    Scene { name: "compare/u32", draw: compare_u32 },
    Scene { name: "compare/types", draw: compare_types },
    Scene { name: "bias", draw: bias },
    Scene { name: "depth_alone", draw: depth_alone },
    Scene { name: "blend", draw: blend },
    Scene { name: "staged", draw: staged },
    Scene { name: "nasty", draw: nasty },
    Scene { name: "spans", draw: spans },
    Scene { name: "conversions", draw: conversions },
];

/// A linear congruential generator: Knuth's MMIX constants.
struct Random(u64);

impl Random {
    fn below(&mut self, n: u32) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % u64::from(n)) as u32
    }

    /// A multiple of 2⁻⁸ in −`range` .. `range`.
    fn number(&mut self, range: u16) -> f32 {
        let range = u32::from(range) * 256;
        (self.below(2 * range) as f32 - range as f32) / 256.0
    }
}

/// Varyings of every kind.
#[derive(Clone, Copy, Debug)]
struct All {
    color: Vec3,
    screen: NoPerspective<Vec2>,
    material: Flat<u32>,
}

halfplane::varyings!(All { color, screen, material });

impl All {
    fn of_vertex(i: usize) -> Self {
        let bit = |shift: usize| f32::from(u8::from(i >> shift & 1 == 1));
        Self {
            color: Vec3::new(bit(0), bit(1), 1.0 - bit(2)),
            screen: NoPerspective(Vec2::new(bit(1) * 7.0, bit(0) * 3.0)),
            material: Flat((i as u32).wrapping_mul(0x9e37_79b9)),
        }
    }

    fn shade(self) -> Vec3 {
        let checker = floor_to_i32(self.screen.0.x) + floor_to_i32(self.screen.0.y);
        let light = if checker & 1 == 0 { 1.0 } else { 0.5 };
        self.color * light
    }
}

/// Eye space to clip space, for an eye at the origin that looks along +z: near plane at 1/8, far plane at 64.
fn to_clip(x: f32, y: f32, z: f32) -> Vec4 {
    const SCALE: f32 = 64.0 / (64.0 - 0.125);
    Vec4::new(x * 1.5, y * 2.0, (z - 0.125) * SCALE, z)
}

/// A cube of 2 × 2 × 2 turned about two axes by angles with rational sines, seen from `distance`.
fn cube(distance: f32) -> [Vec4; 8] {
    core::array::from_fn(|i| {
        let side = |shift: usize| if i >> shift & 1 == 1 { 1.0 } else { -1.0 };
        let (x, y, z): (f32, f32, f32) = (side(0), side(1), side(2));
        let (x, z) = (x * (4.0 / 5.0) - z * (3.0 / 5.0), x * (3.0 / 5.0) + z * (4.0 / 5.0));
        let (y, z) = (y * (12.0 / 13.0) - z * (5.0 / 13.0), y * (5.0 / 13.0) + z * (12.0 / 13.0));
        to_clip(x, y, z + distance)
    })
}

/// Counter-clockwise as seen from outside.
const CUBE: [u16; 36] = [
    0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7,
    5,
];

/// A floor that begins behind the eye and ends near the horizon: two triangles that must be clipped.
const FLOOR: [[f32; 3]; 4] =
    [[-30.0, -1.25, -3.0], [30.0, -1.25, -3.0], [-30.0, -1.25, 60.0], [30.0, -1.25, 60.0]];
const QUAD: [u16; 6] = [0, 1, 2, 2, 1, 3];

fn floor() -> [Vec4; 4] {
    FLOOR.map(|[x, y, z]| to_clip(x, y, z))
}

fn all_attributes() -> Computed<impl Fn(usize) -> All> {
    Computed::new(usize::MAX, All::of_vertex)
}

fn rasterizer<V: Varyings>() -> Option<Rasterizer<V>> {
    Some(Rasterizer::new(Viewport::of_size(WIDTH, HEIGHT).ok()?))
}

/// A colour plane and a depth plane.
type Frame<'a> = Surface<&'a mut [u32], &'a mut [f32]>;

/// What most scenes draw into.
fn frame(memory: &mut Memory) -> Option<Frame<'_>> {
    Surface::new(&mut memory.rgba, &mut memory.depth, WIDTH, HEIGHT).ok()
}

/// The state that is chosen at run time, for [`draw`].
fn chosen(compare: CompareOp) -> Option<Rasterizer<All, DepthState>> {
    Some(rasterizer()?.with_depth_test(DepthState { compare, write: true }))
}

/// Draws with everything chosen at run time, and a closure behind a pointer: compiled once for all scenes that ask what
/// fragments know. Scenes with closures of their own show that what the compiler makes of a shading loop is the same.
#[inline(never)]
fn draw(
    target: &mut Frame<'_>,
    rasterizer: &Rasterizer<All, DepthState>,
    primitives: Primitives<'_, u16>,
    positions: &[Vec4],
    shade: &mut dyn FnMut(&Fragment<'_, All>) -> u32,
) -> Result<Statistics, DrawError> {
    rasterizer.draw(target, primitives, positions, all_attributes(), |fragment| shade(&fragment))
}

/// The cube on the floor, into any framebuffer: what most scenes start from.
fn perspective<F: halfplane::Framebuffer>(
    target: &mut F,
    hash: &mut Hash,
    mut to_color: impl FnMut(Vec3) -> F::Color,
) -> Done {
    let rasterizer = rasterizer::<All>()?;
    let mut shade = |fragment: Fragment<'_, All>| Some(to_color(fragment.varyings().shade()));
    let floor = Primitives::list().indexed(&QUAD);
    hash.statistics(rasterizer.draw(target, floor, &self::floor(), all_attributes(), &mut shade));
    let mut room = [ProjectedVertex::default(); 8];
    let positions = cube(4.5);
    let vertices = rasterizer.project(&positions, &mut room).ok()?;
    let list = Primitives::list().indexed(&CUBE);
    hash.statistics(rasterizer.draw(target, list, vertices, all_attributes(), &mut shade));
    Some(())
}

fn perspective_rgba8_f32(memory: &mut Memory, hash: &mut Hash) -> Done {
    let mut target = Surface::new(&mut memory.rgba, &mut memory.depth, WIDTH, HEIGHT).ok()?;
    perspective(&mut target, hash, |color| pack_rgba8(color.extend(1.0)))?;
    hash.frame32(memory);
    Some(())
}

fn perspective_rgb565_u16(memory: &mut Memory, hash: &mut Hash) -> Done {
    let mut target = Surface::new(&mut memory.rgb565, &mut memory.depth16, WIDTH, HEIGHT).ok()?;
    perspective(&mut target, hash, pack_rgb565)?;
    hash.frame16(memory);
    Some(())
}

/// The three `cut` scenes have the same hash: only the picture counts, not how often it was asked for.
fn cut_whole(memory: &mut Memory, hash: &mut Hash) -> Done {
    let mut target = Surface::new(&mut memory.rgb565, &mut memory.depth16, WIDTH, HEIGHT).ok()?;
    perspective(&mut target, &mut Hash::new(), pack_rgb565)?;
    hash.frame16(memory);
    Some(())
}

fn cut_tiles(memory: &mut Memory, hash: &mut Hash) -> Done {
    const TILE: usize = 11;
    for y in (0..HEIGHT as usize).step_by(TILE) {
        for x in (0..WIDTH as usize).step_by(TILE) {
            let (mut color, mut depth) = ([0; TILE * TILE], [u16::MAX; TILE * TILE]);
            let height = TILE.min(HEIGHT as usize - y);
            let area = Rect { x: x as i32, y: y as i32, width: TILE as u32, height: height as u32 };
            let mut tile = Surface::with_planes(&mut color[..], &mut depth[..], area, TILE).ok()?;
            perspective(&mut tile, &mut Hash::new(), pack_rgb565)?;
            for row in 0..height {
                let (to, from) = ((y + row) * WIDTH as usize + x, row * TILE);
                memory.rgb565[to..to + TILE].copy_from_slice(&color[from..from + TILE]);
                memory.depth16[to..to + TILE].copy_from_slice(&depth[from..from + TILE]);
            }
        }
    }
    hash.frame16(memory);
    Some(())
}

fn cut_bands(memory: &mut Memory, hash: &mut Hash) -> Done {
    let frame = Surface::new(&mut memory.rgb565, &mut memory.depth16, WIDTH, HEIGHT).ok()?;
    for mut band in frame.bands(7) {
        perspective(&mut band, &mut Hash::new(), pack_rgb565)?;
    }
    hash.frame16(memory);
    Some(())
}

/// All numbers of all fragments, clipped triangles' and others'.
fn fragments(memory: &mut Memory, hash: &mut Hash) -> Done {
    let mut target = frame(memory)?;
    let rasterizer = chosen(CompareOp::Less)?;
    for (positions, indices) in [(&floor()[..], &QUAD[..]), (&cube(1.5), &CUBE), (&cube(4.0), &CUBE)] {
        let list = Primitives::list().indexed(indices);
        let statistics = draw(&mut target, &rasterizer, list, positions, &mut |fragment| {
            hash.fragment(fragment);
            fragment.primitive_index()
        });
        hash.statistics(statistics);
    }
    hash.frame32(memory);
    Some(())
}

fn derivatives(memory: &mut Memory, hash: &mut Hash) -> Done {
    let mut target = frame(memory)?;
    let rasterizer = chosen(CompareOp::Less)?;
    for (positions, indices) in [(&floor()[..], &QUAD[..]), (&cube(3.0), &CUBE)] {
        let list = Primitives::list().indexed(indices);
        let statistics = draw(&mut target, &rasterizer, list, positions, &mut |fragment| {
            hash.all(&fragment.varyings_dx());
            hash.all(&fragment.varyings_dy());
            fragment.varyings().material.0
        });
        hash.statistics(statistics);
    }
    hash.frame32(memory);
    Some(())
}

/// Smooth, flat and noperspective values side by side, with either provoking vertex, on clipped triangles too.
fn qualifiers(memory: &mut Memory, hash: &mut Hash) -> Done {
    let mut target = frame(memory)?;
    let mut rasterizer = chosen(CompareOp::Less)?;
    for (provoking, distance) in [(ProvokingVertex::First, 4.0), (ProvokingVertex::Last, 1.25)] {
        rasterizer.provoking_vertex = provoking;
        let list = Primitives::list().indexed(&CUBE);
        let statistics = draw(&mut target, &rasterizer, list, &cube(distance), &mut |fragment| {
            let all = fragment.varyings();
            hash.all(&all);
            pack_rgba8(all.shade().extend(1.0))
        });
        hash.statistics(statistics);
    }
    hash.frame32(memory);
    Some(())
}

/// Triangles one at a time, and every number of every fragment.
fn draw_numbers(
    memory: &mut Memory,
    hash: &mut Hash,
    rasterizer: &Rasterizer<All, DepthState>,
    triangles: &[[Vec4; 3]],
) -> Done {
    let mut target = frame(memory)?;
    for triangle in triangles {
        let one = Primitives::list().indexed(&[0, 1, 2]);
        let statistics = draw(&mut target, rasterizer, one, triangle, &mut |fragment| {
            hash.fragment(fragment);
            hash.all(&fragment.varyings());
            pack_rgba8(fragment.varyings().color.extend(1.0))
        });
        hash.statistics(statistics);
    }
    hash.frame32(memory);
    Some(())
}

/// Every way in which the near plane, the far plane and the eye's plane can cut a triangle.
fn clip_near(memory: &mut Memory, hash: &mut Hash) -> Done {
    let depths = [-2.0, 0.0, 0.1, 0.5, 4.0, 100.0];
    for a in depths {
        for b in depths {
            let triangle = [to_clip(-1.0, -1.0, a), to_clip(1.5, -0.5, b), to_clip(0.25, 1.25, 2.0)];
            draw_numbers(memory, hash, &chosen(CompareOp::Less)?, &[triangle])?;
        }
    }
    Some(())
}

/// Corners up to 2⁴⁰ pixels away.
fn clip_guard_band(memory: &mut Memory, hash: &mut Hash) -> Done {
    let far = |exponent: u32| (1u64 << exponent) as f32;
    for exponent in [8, 9, 10, 14, 23, 40] {
        let far = far(exponent);
        let triangles = [
            [
                Vec4::new(-far, -0.5, 0.25, 1.0),
                Vec4::new(far, -0.25, 0.5, 1.0),
                Vec4::new(0.1, far, 0.75, 1.0),
            ],
            [
                Vec4::new(0.0, 0.3, 0.1, 1.0),
                Vec4::new(far, far, 0.5, 2.0),
                Vec4::new(-far, far * 0.5, 0.3, 1.0),
            ],
            [Vec4::new(-0.5, -far, 0.2, 0.5), Vec4::new(0.5, 0.5, 0.2, 0.5), Vec4::new(-0.75, far, 3.0, 4.0)],
        ];
        draw_numbers(memory, hash, &chosen(CompareOp::Less)?, &triangles)?;
    }
    Some(())
}

fn clip_depth_clamp(memory: &mut Memory, hash: &mut Hash) -> Done {
    let mut rasterizer = chosen(CompareOp::LessOrEqual)?;
    rasterizer.depth_clip = DepthClip::Clamp;
    rasterizer.viewport = rasterizer.viewport.with_depth_range(0.25, 0.875).ok()?;
    let triangles = [
        [to_clip(-1.0, -1.0, 0.05), to_clip(1.5, -0.5, 90.0), to_clip(0.25, 1.25, 2.0)],
        [to_clip(-1.0, 1.0, -0.5), to_clip(2.0, -0.5, 3.0), to_clip(-0.25, -1.0, 1.0)],
    ];
    draw_numbers(memory, hash, &rasterizer, &triangles)
}

fn clip_negative_one_to_one(memory: &mut Memory, hash: &mut Hash) -> Done {
    let mut rasterizer = chosen(CompareOp::Less)?;
    rasterizer.clip_depth = ClipDepth::NegativeOneToOne;
    let vertex = |x, y, z, w| Vec4::new(x, y, z, w);
    let triangles = [
        [vertex(-1.0, -1.0, -1.0, 1.0), vertex(2.0, -1.0, 1.0, 2.0), vertex(0.0, 3.0, 3.0, 3.0)],
        [vertex(-1.0, 1.0, -2.0, 1.0), vertex(2.0, 1.0, 0.0, 2.0), vertex(0.0, -1.0, 3.0, 1.0)],
    ];
    draw_numbers(memory, hash, &rasterizer, &triangles)
}

/// A fan whose rim is up to 10⁶ pixels away, and closed strips so thin that most rows miss every sample.
fn slivers(memory: &mut Memory, hash: &mut Hash) -> Done {
    let mut target = frame(memory)?;
    let mut rasterizer = chosen(CompareOp::Always)?;
    rasterizer.front_face = FrontFace::Clockwise;
    for radius in [100.0f32, 1e4, 1e6] {
        // Sixteen directions with rational slopes, around a point on a sample.
        let around: [Vec4; 17] = core::array::from_fn(|i| {
            if i == 0 {
                return Vec4::new(1.0 / WIDTH as f32, 0.0, 0.5, 1.0);
            }
            let (octant, step) = ((i - 1) / 2, ((i - 1) % 2) as f32);
            let (x, y) = match octant {
                0 => (4.0, 1.0 + step),
                1 => (2.0 - step, 4.0),
                2 => (-step, 4.0),
                3 => (-4.0, 3.0 - step),
                4 => (-4.0, -step),
                5 => (-3.0 + step, -4.0),
                6 => (step, -4.0),
                _ => (4.0, -3.0 + step),
            };
            Vec4::new(x * radius, y * radius, 0.5, 1.0)
        });
        let fan: [u16; 18] = core::array::from_fn(|i| if i == 17 { 1 } else { i as u16 });
        let fan = Primitives::fan().indexed(&fan);
        let statistics = draw(&mut target, &rasterizer, fan, &around, &mut |fragment| {
            hash.fragment(fragment);
            pack_rgba8(fragment.varyings().color.extend(0.0))
        });
        hash.statistics(statistics);
    }
    let mut random = Random(7);
    for _ in 0..40 {
        let (x, y) = (random.number(1), random.number(1));
        let thin = [
            Vec4::new(x, y, 0.1, 1.0),
            Vec4::new(x + random.number(40), y + random.number(40), 0.9, 1.0),
            Vec4::new(x + 1.0 / 256.0, y + random.number(1) / 64.0, 0.4, 1.0),
        ];
        let one = Primitives::list().indexed(&[0, 1, 2]);
        let statistics = draw(&mut target, &rasterizer, one, &thin, &mut |fragment| {
            hash.fragment(fragment);
            pack_rgba8(fragment.varyings().color.extend(1.0))
        });
        hash.statistics(statistics);
    }
    hash.frame32(memory);
    Some(())
}

/// A bumpy sheet of triangles of a few pixels, corners on the half-pixel grid and beside it.
fn small(memory: &mut Memory, hash: &mut Hash) -> Done {
    const SIDE: usize = 16;
    let vertex = |i: usize| {
        let (x, y) = ((i % SIDE) as f32, (i / SIDE) as f32);
        let bump = ((i * i * 7 + i * 3) % 11) as f32 / 11.0;
        let w = 1.0 + bump;
        let (x, y) = (x / 7.5 - 1.0 + bump * 0.1, 1.0 - y / 7.5);
        Vec4::new(x * w, y * w, (0.25 + 0.5 * bump) * w, w)
    };
    let positions = Computed::new(SIDE * SIDE, vertex);
    let mut indices = [[0u16; 3]; 2 * (SIDE - 1) * (SIDE - 1)];
    for (i, pair) in indices.chunks_exact_mut(2).enumerate() {
        let a = (i / (SIDE - 1) * SIDE + i % (SIDE - 1)) as u16;
        let (b, c, d) = (a + 1, a + SIDE as u16, a + SIDE as u16 + 1);
        pair.copy_from_slice(&[[a, c, b], [b, c, d]]);
    }
    let rasterizer = rasterizer::<All>()?;
    let mut target = Surface::new(&mut memory.rgb565, &mut memory.depth16, WIDTH, HEIGHT).ok()?;
    let list = Primitives::list().indexed(indices.as_flattened());
    let statistics = rasterizer.draw(&mut target, list, positions, all_attributes(), |fragment| {
        pack_rgb565(fragment.varyings().shade())
    });
    hash.statistics(statistics);
    hash.frame16(memory);
    Some(())
}

/// Runs longer than any vector or chunk, with a part in the middle that fails the depth test.
fn wide(memory: &mut Memory, hash: &mut Hash) -> Done {
    const ROWS: u32 = 3;
    const COLUMNS: u32 = 700;
    let mut rasterizer = Rasterizer::<Vec3>::new(Viewport::of_size(COLUMNS, ROWS).ok()?);
    let mut target = Surface::new(&mut memory.rgba, &mut memory.depth16, COLUMNS, ROWS).ok()?;
    let mut room = |z: f32, from: f32, to: f32| {
        let positions = [
            Vec4::new(from, -1.0, z, 1.0),
            Vec4::new(to * 2.0, -2.0, z, 2.0),
            Vec4::new(from * 3.0, 3.0, z, 3.0),
            Vec4::new(to * 4.0, 4.0, z * 4.0, 4.0),
        ];
        let colors = [Vec3::ONE, Vec3::X, Vec3::Y, Vec3::Z];
        rasterizer.cull_mode = CullMode::None;
        let strip = Primitives::strip();
        hash.statistics(rasterizer.draw(&mut target, strip, &positions, &colors, |fragment| {
            pack_rgba8(fragment.varyings().extend(fragment.depth()))
        }));
    };
    room(0.125, -0.3, 0.2);
    room(0.25, 0.4, 0.43);
    room(0.5, -1.0, 1.0);
    hash.words(memory.rgba);
    hash.words(memory.depth16.map(u32::from));
    Some(())
}

/// Lists, strips and fans; with indices of each width, with restarts and without indices; attributes of each kind.
fn topologies(memory: &mut Memory, hash: &mut Hash) -> Done {
    let mut random = Random(3);
    let positions: [Vec4; 24] = core::array::from_fn(|_| {
        let w = 1.0 + random.below(256) as f32 / 128.0;
        Vec4::new(random.number(1) * w, random.number(1) * w, random.below(256) as f32 / 256.0 * w, w)
    });
    let bytes: [u8; 30] = core::array::from_fn(|i| if i % 7 == 6 { u8::MAX } else { (i * 5 % 24) as u8 });
    let shorts = bytes.map(|i| if i == u8::MAX { u16::MAX } else { u16::from(i) });
    let longs = bytes.map(|i| if i == u8::MAX { u32::MAX } else { u32::from(i) });
    let rasterizer = rasterizer::<(Vec3, Flat<u32>)>()?;
    let mut target = Surface::new(&mut memory.rgba, &mut memory.depth, WIDTH, HEIGHT).ok()?;
    let all: [All; 24] = core::array::from_fn(All::of_vertex);
    let varyings =
        (Attribute::field(&all, |all| all.color), Attribute::field(&all, |all| Flat(all.material.0)));
    let shade = |fragment: Fragment<'_, (Vec3, Flat<u32>)>| {
        let (color, Flat(material)) = fragment.varyings();
        pack_rgba8(color.extend(1.0)) ^ material
    };
    for topology in [Topology::List, Topology::Strip, Topology::Fan] {
        let all = Primitives::new(topology);
        hash.statistics(rasterizer.draw(&mut target, all, &positions, varyings, shade));
        let restarting = all.indexed(&bytes).with_restart();
        hash.statistics(rasterizer.draw(&mut target, restarting, &positions, varyings, shade));
        let restarting = all.indexed(&shorts).with_restart();
        hash.statistics(rasterizer.draw(&mut target, restarting, &positions, varyings, shade));
        let restarting = all.indexed(&longs).with_restart();
        hash.statistics(rasterizer.draw(&mut target, restarting, &positions, varyings, shade));
        let out_of_range = all.indexed(&bytes);
        hash.statistics(rasterizer.draw(&mut target, out_of_range, &positions, varyings, shade));
    }
    hash.frame32(memory);
    Some(())
}

fn faces(memory: &mut Memory, hash: &mut Hash) -> Done {
    let mut target = frame(memory)?;
    let mut rasterizer = chosen(CompareOp::Less)?;
    let mut distance = 6.0;
    for cull_mode in [CullMode::None, CullMode::Front, CullMode::Back] {
        for front_face in [FrontFace::CounterClockwise, FrontFace::Clockwise] {
            (rasterizer.cull_mode, rasterizer.front_face) = (cull_mode, front_face);
            let list = Primitives::list().indexed(&CUBE);
            hash.statistics(draw(&mut target, &rasterizer, list, &cube(distance), &mut |fragment| {
                let side = f32::from(u8::from(fragment.is_front_facing()));
                pack_rgba8(fragment.varyings().color.extend(side))
            }));
            distance -= 0.75;
        }
    }
    hash.frame32(memory);
    Some(())
}

/// Parts of the frame, fractions of pixels, upside down, depth backwards, scissors, and rows with padding.
fn viewports(memory: &mut Memory, hash: &mut Hash) -> Done {
    let mut rasterizer = chosen(CompareOp::Always)?;
    let area = Rect { x: -9, y: 3, width: 50, height: 30 };
    let stride = WIDTH as usize;
    let mut target = Surface::with_planes(&mut memory.rgba[..], &mut memory.depth[..], area, stride).ok()?;
    let viewports = [
        Viewport::new(-9.0, 3.0, 20.0, 30.0).ok()?,
        Viewport::new(5.3, 28.7, 30.2, -17.9).ok()?.with_depth_range(1.0, 0.25).ok()?,
        Viewport::new(-100.0, -50.0, 300.0, 75.5).ok()?,
    ];
    let scissors = [
        None,
        Some(Rect { x: 7, y: 5, width: 20, height: 100 }),
        Some(Rect { x: 0, y: 0, width: 33, height: 9 }),
    ];
    for viewport in viewports {
        for scissor in scissors {
            (rasterizer.viewport, rasterizer.scissor) = (viewport, scissor);
            let list = Primitives::list().indexed(&CUBE);
            hash.statistics(draw(&mut target, &rasterizer, list, &cube(3.5), &mut |fragment| {
                pack_rgba8(fragment.varyings().shade().extend(fragment.inv_w()))
            }));
        }
    }
    hash.frame32(memory);
    Some(())
}

const OPERATIONS: [CompareOp; 8] = [
    CompareOp::Never,
    CompareOp::Less,
    CompareOp::Equal,
    CompareOp::LessOrEqual,
    CompareOp::Greater,
    CompareOp::NotEqual,
    CompareOp::GreaterOrEqual,
    CompareOp::Always,
];

/// Two sheets that cross, and the first again: what a depth test tells apart.
fn compare<D: DepthFormat>(
    color: &mut [u32],
    depth: &mut [D],
    test: impl DepthTest,
    hash: &mut Hash,
) -> Done {
    let mut target = Surface::new(color, depth, WIDTH, HEIGHT).ok()?;
    let rising = [
        Vec4::new(-1.0, -1.0, 0.0, 1.0),
        Vec4::new(1.0, -1.0, 1.0, 1.0),
        Vec4::new(-1.0, 1.0, 0.0, 1.0),
        Vec4::new(1.0, 1.0, 1.0, 1.0),
    ];
    let falling = [
        Vec4::new(-0.75, -2.0, 2.0, 2.0),
        Vec4::new(0.875, -1.0, 0.25, 1.0),
        Vec4::new(-1.5, 2.0, 2.0, 2.0),
        Vec4::new(0.75, 1.0, 0.125, 1.0),
    ];
    let rasterizer = rasterizer::<()>()?.with_depth_test(test);
    for (positions, color) in [(&rising, 0x00ff), (&falling, 0xff00), (&rising, 0x00ff_0000)] {
        let statistics = rasterizer.draw(&mut target, Primitives::strip(), positions, (), |fragment| {
            // Every third column is discarded, and must then keep its depth.
            (fragment.x() % 3 != 0).then_some(color)
        });
        hash.statistics(statistics);
    }
    Some(())
}

fn compare_states<D: DepthFormat>(
    color: &mut [u32],
    depth: &mut [D],
    hash: &mut Hash,
    mut to_word: impl FnMut(D) -> u32,
) -> Done {
    for operation in OPERATIONS {
        for write in [true, false] {
            depth.fill(D::from_depth(0.5));
            compare(color, depth, DepthState { compare: operation, write }, hash)?;
            hash.words(color.iter().copied());
            hash.words(depth.iter().map(|&depth| to_word(depth)));
        }
    }
    Some(())
}

fn compare_f32(memory: &mut Memory, hash: &mut Hash) -> Done {
    compare_states(&mut memory.rgba, &mut memory.depth, hash, f32::to_bits)
}

fn compare_u16(memory: &mut Memory, hash: &mut Hash) -> Done {
    compare_states(&mut memory.rgba, &mut memory.depth16, hash, u32::from)
}

fn compare_depth24(memory: &mut Memory, hash: &mut Hash) -> Done {
    let mut depth = memory.depth32.map(|_| Depth24(0));
    compare_states(&mut memory.rgba, &mut depth, hash, |depth| depth.0)
}

fn compare_u32(memory: &mut Memory, hash: &mut Hash) -> Done {
    compare_states(&mut memory.rgba, &mut memory.depth32, hash, |depth| depth)
}

/// The same comparisons as types.
fn compare_types(memory: &mut Memory, hash: &mut Hash) -> Done {
    fn one(memory: &mut Memory, test: impl DepthTest, hash: &mut Hash) -> Done {
        memory.depth16.fill(u16::MAX / 2);
        compare(&mut memory.rgba, &mut memory.depth16, test, hash)?;
        hash.words(memory.rgba);
        hash.words(memory.depth16.map(u32::from));
        Some(())
    }
    one(memory, Never, hash)?;
    one(memory, Less, hash)?;
    one(memory, Equal, hash)?;
    one(memory, LessOrEqual, hash)?;
    one(memory, Greater, hash)?;
    one(memory, NotEqual, hash)?;
    one(memory, GreaterOrEqual, hash)?;
    one(memory, ReadOnly(Less), hash)
}

/// Depth alone, moved by every kind of bias, in a floating and a fixed format.
fn bias(memory: &mut Memory, hash: &mut Hash) -> Done {
    let mut rasterizer = rasterizer::<()>()?.with_depth_test(Always);
    let biases = [
        DepthBias { constant: 3.0, slope: 0.0, clamp: 0.0 },
        DepthBias { constant: -2.0, slope: 1.5, clamp: 0.0 },
        DepthBias { constant: 0.0, slope: -4.0, clamp: -0.001 },
        DepthBias { constant: 1e6, slope: 100.0, clamp: 0.125 },
        DepthBias { constant: 0.0, slope: f32::INFINITY, clamp: 0.0 },
        DepthBias { constant: f32::NAN, slope: 1.0, clamp: 0.0 },
    ];
    for bias in biases {
        rasterizer.depth_bias = bias;
        let list = Primitives::list().indexed(&CUBE);
        let mut floating = Surface::depth_only(&mut memory.depth, WIDTH, HEIGHT).ok()?;
        hash.statistics(rasterizer.draw(&mut floating, list, &cube(3.0), (), |_| ()));
        let mut fixed = Surface::depth_only(&mut memory.depth16, WIDTH, HEIGHT).ok()?;
        hash.statistics(rasterizer.draw(&mut fixed, list, &cube(3.0), (), |_| ()));
        hash.frame32(memory);
        hash.frame16(memory);
    }
    Some(())
}

/// Depth by the draw that does nothing else, of a cube and of confetti from a pixel up to a third of the frame.
fn depth_alone(memory: &mut Memory, hash: &mut Hash) -> Done {
    let rasterizer = rasterizer::<()>()?;
    let mut random = Random(29);
    let mut confetti = [Vec4::ZERO; 96];
    for (i, corners) in confetti.chunks_exact_mut(3).enumerate() {
        let centre = Vec4::new(random.number(2), random.number(2), random.number(1) + 1.0, 0.0) * 0.5;
        let size = [0.03125, 0.125, 0.25, 0.5][i % 4];
        for corner in corners {
            let offset = Vec4::new(random.number(1), random.number(1), random.number(1) * 0.25, 0.0);
            *corner = (centre + offset * size).with_w(1.0) * (1.5 + random.number(1));
        }
    }
    let mut floating = Surface::depth_only(&mut memory.depth, WIDTH, HEIGHT).ok()?;
    hash.statistics(rasterizer.draw_depth(&mut floating, Primitives::list(), &confetti[..]));
    let list = Primitives::list().indexed(&CUBE);
    hash.statistics(rasterizer.draw_depth(&mut floating, list, cube(3.0)));
    let mut fixed = Surface::depth_only(&mut memory.depth16, WIDTH, HEIGHT).ok()?;
    hash.statistics(rasterizer.draw_depth(&mut fixed, list, cube(3.0)));
    hash.statistics(rasterizer.draw_depth(&mut fixed, Primitives::list(), &confetti[..]));
    hash.frame32(memory);
    hash.frame16(memory);
    Some(())
}

/// Blending without a depth buffer.
fn blend(memory: &mut Memory, hash: &mut Hash) -> Done {
    let rasterizer = rasterizer::<Vec3>()?;
    let mut target = Surface::color_only(&mut memory.rgba, WIDTH, HEIGHT).ok()?;
    let colors: [Vec3; 8] = core::array::from_fn(|i| All::of_vertex(i).color);
    let list = Primitives::list().indexed(&CUBE);
    hash.statistics(rasterizer.draw_over(&mut target, list, &cube(3.25), &colors, |fragment, below| {
        let (new, old) = (fragment.varyings().extend(1.0), unpack_rgba8(below));
        pack_rgba8(old * 0.625 + new * 0.375)
    }));
    hash.words(memory.rgba);
    Some(())
}

/// Shading in two stages, with a texture, discards and the colour there.
fn staged(memory: &mut Memory, hash: &mut Hash) -> Done {
    let rasterizer = rasterizer::<(Vec2, Vec3)>()?;
    let values: [(Vec2, Vec3); 8] = core::array::from_fn(|i| {
        let All { screen, color, .. } = All::of_vertex(i);
        (screen.0, color)
    });
    let texels: [u32; 64] = core::array::from_fn(|i| (i as u32).wrapping_mul(0x9e37_79b1));
    let list = Primitives::list().indexed(&CUBE);
    let staged = rasterizer.staged(|fragment| {
        let (uv, color) = fragment.varyings();
        let texel = uv + fragment.varyings_dx().0;
        ([texel.x, texel.y].map(floor_to_i32), color, fragment.is_front_facing())
    });
    let mut target = frame(memory)?;
    hash.statistics(staged.draw_over(
        &mut target,
        list,
        &cube(3.25),
        &values,
        |([x, y], color, is_front), below| {
            let texel = texels[((y & 7) << 3 | x & 7) as usize];
            let color = unpack_rgba8(texel ^ below) * 0.5 + color.extend(0.0) * 0.5;
            (is_front || texel & 8 == 0).then_some(pack_rgba8(color))
        },
    ));
    hash.frame32(memory);
    Some(())
}

/// What must not break anything: every coordinate may be anything.
fn nasty(memory: &mut Memory, hash: &mut Hash) -> Done {
    let strange = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        1e30,
        -1e30,
        1e-40,
        -1e-30,
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.5,
        16_384.0,
        -3.0,
        2.0,
    ];
    let mut random = Random(5);
    let mut number = || {
        // Half of them are ordinary, so that some triangles are drawn.
        let i = random.below(32) as usize;
        strange.get(i).copied().unwrap_or_else(|| random.number(3))
    };
    let mut target = frame(memory)?;
    let mut rasterizer = chosen(CompareOp::LessOrEqual)?;
    for i in 0..600 {
        rasterizer.depth_clip = if i % 2 == 0 { DepthClip::Clip } else { DepthClip::Clamp };
        rasterizer.depth_bias.constant = if i % 5 == 0 { number() } else { 0.0 };
        let positions: [Vec4; 3] = core::array::from_fn(|_| {
            let w = number();
            Vec4::new(number(), number(), number(), if w < 0.0 && i % 3 != 0 { -w } else { w })
        });
        let color = Vec3::new(number(), number(), number());
        let one = Primitives::list().indexed(&[0, 1, 2]);
        hash.statistics(draw(&mut target, &rasterizer, one, &positions, &mut |fragment| {
            pack_rgba8((fragment.varyings().color * color).extend(1.0))
        }));
    }
    hash.frame32(memory);
    Some(())
}

/// Setup and traversal by themselves.
fn spans(_: &mut Memory, hash: &mut Hash) -> Done {
    let mut random = Random(11);
    let area = Rect { x: -20, y: -10, width: 70, height: 50 };
    for (size, step) in [(4u32, 128u32), (12, 64), (40, 1), (63, 1), (64, 128), (300, 16), (30_000, 1)] {
        for _ in 0..60 {
            let mut at = || (random.below(size * 256 / step) * step) as i32 - (size * 128) as i32 + 1000;
            let mut vertex = || {
                let (x, y) = (at(), at());
                ProjectedVertex::new(x, y, 0.5, 1.0 / (1.0 + (x & 0xff) as f32))
            };
            let vertices = [vertex()?, vertex()?, vertex()?];
            let Some(setup) = Setup::new(vertices) else {
                hash.word(0);
                continue;
            };
            let Rect { x, y, width, height } = setup.bounds();
            hash.words([x as u32, y as u32, width, height]);
            hash.words(setup.order().map(u32::from));
            hash.long(setup.area2() as u64);
            for edge in setup.edges() {
                hash.long(edge.at(3, -5) as u64);
                hash.word(u32::from(edge.is_top_left()));
            }
            setup.for_each_span(area, |span| {
                for place in [span.y(), span.start(), span.end(), span.anchor()] {
                    hash.word(place as u32);
                }
                hash.floats(span.edges());
            });
            for block in 0..48 {
                let rect = Rect { x: block % 8 * 8 - 16, y: block / 8 * 8 - 8, width: 8, height: 8 };
                hash.word(match setup.coverage(rect) {
                    Coverage::None => 0,
                    Coverage::Partial => 1,
                    Coverage::Full => 2,
                });
            }
        }
    }
    Some(())
}

/// The conversions that shaders end with, at ties, ends and beyond them.
fn conversions(_: &mut Memory, hash: &mut Hash) -> Done {
    let mut random = Random(13);
    for i in 0..2000u32 {
        let x = match i {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => -1e30,
            3..=259 => (i - 3) as f32 / 255.0,
            260..=515 => (2 * (i - 260) + 1) as f32 / 510.0,
            _ => random.number(2) + random.below(256) as f32 / 65_536.0,
        };
        hash.word(pack_rgba8(Vec4::new(x, 1.0 - x, x * x, -x)));
        hash.word(pack_bgra8(Vec4::new(x, 1.0 - x, x * x, -x)));
        hash.word(u32::from(pack_rgb565(Vec3::new(x, 1.0 - x, x * 0.5))));
        hash.floats(unpack_rgba8(i.wrapping_mul(0x9e37_79b9)).to_array());
        hash.words([u32::from(u16::from_depth(x)), Depth24::from_depth(x).0, u32::from_depth(x)]);
        if i > 2 {
            hash.word(floor_to_i32(x * 1000.0) as u32);
            hash.float(wrap(x * 1000.0));
        }
    }
    Some(())
}
