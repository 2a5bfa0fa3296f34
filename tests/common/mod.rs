//! What the tests share: frames, positions given in pixels, pictures, records of fragments, and repeatable randomness.

#![allow(dead_code, reason = "every test file uses a part of it")]

use core::fmt::Write as _;
use std::env;

use glam::Vec4;
use halfplane::{
    Always, Attributes, DepthTest, Flat, Fragment, Framebuffer, Index, NoPerspective, Positions, Primitives,
    ProjectedVertex, Rasterizer, Rect, Surface, Varyings, Viewport,
};
use proptest::test_runner::{Config, RngSeed};

/// Whether the target has SIMD. Only there are triangles sifted before they are drawn, and hidden ones left out by coarse depth;
/// elsewhere they are drawn one fragment after the other, and look the same.
pub(crate) const HAS_SIMD: bool =
    cfg!(any(target_arch = "x86_64", target_arch = "x86", target_arch = "aarch64", target_arch = "wasm32"));

/// A frame with (0, 0) as its top left pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    pub(crate) width: u32,
    pub(crate) height: u32,
}

impl Frame {
    pub(crate) const fn new(width: u32, height: u32) -> Self {
        Self { width, height }
    }

    pub(crate) fn area(self) -> Rect {
        Rect::of_size(self.width, self.height)
    }

    pub(crate) fn viewport(self) -> Viewport {
        Viewport::of_size(self.width, self.height).expect("a legal size")
    }

    /// The number of its pixels.
    pub(crate) fn len(self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The clip-space position of a point of the frame, y down, with an NDC depth and a w.
    ///
    /// Exact for points of the subpixel grid, for powers of two as sizes and w, near the frame; and always near enough
    /// to come out at the same subpixel.
    pub(crate) fn place(self, x: f32, y: f32, depth: f32, w: f32) -> Vec4 {
        Vec4::new(x * 2.0 / self.width as f32 - 1.0, 1.0 - y * 2.0 / self.height as f32, depth, 1.0) * w
    }

    /// [`place`](Self::place) with depth ½ and w = 1.
    pub(crate) fn at(self, [x, y]: [f32; 2]) -> Vec4 {
        self.place(x, y, 0.5, 1.0)
    }

    /// Triangles of all sizes, some of them clipped: random corners around the frame, small offsets between them or large
    /// ones, any w, some behind the eye.
    pub(crate) fn triangles(self, random: &mut Random) -> (Vec<Vec4>, Vec<Mixed>) {
        let (mut positions, mut values) = (Vec::new(), Vec::new());
        for _ in 0..random.between(1, 8) {
            let middle = [self.width, self.height].map(|size| random.range(-4.0, size as f32 + 4.0));
            let reach = random.choose(&[2.0, 10.0, 40.0, 200.0, 30_000.0]);
            let grid = random.choose(&[2.0, 256.0, 1e4]);
            for _ in 0..3 {
                let [x, y] = middle.map(|c| ((c + random.range(-reach, reach)) * grid).round() / grid);
                let depth = random.range(-0.1, 1.1);
                let w = random.choose(&[0.3, 1.0, 1.0, 2.0, 5.7, 100.0, -0.5]);
                positions.push(self.place(x, y, depth, w));
                values.push(mixed(random.range(-9.0, 9.0), random.unit(), random.choose(&[1, 2, 3])));
            }
        }
        (positions, values)
    }

    /// How often each pixel is drawn by a list of triangles.
    pub(crate) fn counts(self, positions: &[Vec4]) -> Vec<u8> {
        self.counts_of(&Rasterizer::<()>::new(self.viewport()), Primitives::list(), positions)
    }

    /// How often each pixel is drawn.
    pub(crate) fn counts_of<T: DepthTest, I: Index>(
        self,
        rasterizer: &Rasterizer<(), T>,
        primitives: Primitives<'_, I>,
        positions: &[Vec4],
    ) -> Vec<u8> {
        let mut counts = vec![0; self.len()];
        let mut target = Surface::color_only(&mut counts, self.width, self.height).expect("it fits");
        let count = |_: Fragment<'_, ()>, count: u8| count.saturating_add(1);
        rasterizer
            .with_depth_test(Always)
            .draw_over(&mut target, primitives, positions, (), count)
            .expect("legal input");
        counts
    }

    /// Fronts less backs, a pixel: what a list of triangles sums to with signs.
    pub(crate) fn signed_counts(self, positions: &[Vec4]) -> Vec<i32> {
        let mut counts = vec![0; self.len()];
        let mut target = Surface::color_only(&mut counts, self.width, self.height).expect("it fits");
        Rasterizer::<()>::new(self.viewport())
            .draw_over(&mut target, Primitives::list(), positions, (), |fragment, count| {
                count + if fragment.is_front_facing() { 1 } else { -1 }
            })
            .expect("legal input");
        counts
    }

    /// What does not hold of every pixel is shown as a picture.
    #[track_caller]
    pub(crate) fn assert_all<C: Copy + Into<i64>>(
        self,
        counts: &[C],
        what: &str,
        holds: impl Fn(i32, i32, i64) -> bool,
    ) {
        if let Some(complaint) = self.complaint(counts, holds) {
            panic!("{what}\n{complaint}");
        }
    }

    /// The pixels of which something does not hold, if there are any.
    pub(crate) fn complaint<C: Copy + Into<i64>>(
        self,
        counts: &[C],
        holds: impl Fn(i32, i32, i64) -> bool,
    ) -> Option<String> {
        let mut complaint = String::new();
        for (y, row) in (0..).zip(counts.chunks(self.width as usize)) {
            for (x, &count) in (0..).zip(row) {
                if !holds(x, y, count.into()) {
                    let _ = write!(complaint, "({x}, {y}): {}  ", count.into());
                }
            }
        }
        (!complaint.is_empty()).then_some(complaint)
    }
}

/// Compares counts with a picture: a digit says how often a pixel is drawn, a blank that it never is.
#[track_caller]
pub(crate) fn assert_picture(counts: &[u8], expected: &[&str]) {
    let width = expected.first().map_or(1, |row| row.len());
    let actual: Vec<String> = counts
        .chunks(width)
        .map(|row| row.iter().map(|&n| if n == 0 { ' ' } else { char::from(b'0' + n.min(9)) }).collect())
        .collect();
    assert_eq!(
        actual,
        expected,
        "drawn on the left, expected on the right:\n{}",
        side_by_side(&actual, expected)
    );
}

fn side_by_side(actual: &[String], expected: &[&str]) -> String {
    actual.iter().zip(expected).fold(String::new(), |mut text, (actual, expected)| {
        let _ = writeln!(text, "|{actual}|   |{expected}|");
        text
    })
}

/// A value of every qualifier.
pub(crate) type Mixed = ([f32; 2], NoPerspective<f32>, Flat<u32>);

pub(crate) fn mixed(u: f32, v: f32, flat: u32) -> Mixed {
    ([u, v], NoPerspective(u), Flat(flat))
}

/// Everything that a fragment tells, in bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Record {
    pub(crate) primitive: u32,
    pub(crate) y: i32,
    pub(crate) x: i32,
    pub(crate) is_front_facing: bool,
    pub(crate) depth: u32,
    pub(crate) inv_w: u32,
    pub(crate) weights: [u32; 3],
    pub(crate) barycentrics: [u32; 3],
    pub(crate) values: [u32; 4],
    pub(crate) values_dx: [u32; 4],
    pub(crate) values_dy: [u32; 4],
}

impl Record {
    pub(crate) fn of(fragment: &Fragment<'_, Mixed>) -> Self {
        let bits =
            |([u, v], NoPerspective(n), Flat(flat)): Mixed| [u.to_bits(), v.to_bits(), n.to_bits(), flat];
        Self {
            primitive: fragment.primitive_index(),
            y: fragment.y(),
            x: fragment.x(),
            is_front_facing: fragment.is_front_facing(),
            depth: fragment.depth().to_bits(),
            inv_w: fragment.inv_w().to_bits(),
            weights: fragment.weights().map(f32::to_bits),
            barycentrics: fragment.barycentrics().map(f32::to_bits),
            values: bits(fragment.varyings()),
            values_dx: bits(fragment.varyings_dx()),
            values_dy: bits(fragment.varyings_dy()),
        }
    }
}

/// The records of a draw's fragments, in the order drawn.
pub(crate) fn records<F, T, I, P, A>(
    rasterizer: &Rasterizer<Mixed, T>,
    target: &mut F,
    primitives: Primitives<'_, I>,
    positions: P,
    values: A,
) -> Vec<Record>
where
    F: Framebuffer<Color = ()>,
    T: DepthTest,
    I: Index,
    P: Positions,
    A: Attributes<Value = Mixed>,
{
    let mut records = Vec::new();
    rasterizer
        .draw(target, primitives, positions, values, |fragment| records.push(Record::of(&fragment)))
        .expect("legal input");
    records
}

/// The records of a triangle on a target without memory that has these pixels.
pub(crate) fn records_of<V>(
    rasterizer: &Rasterizer<Mixed, V>,
    area: Rect,
    positions: &[Vec4],
    values: &[Mixed],
) -> Vec<Record>
where
    V: DepthTest,
{
    let mut target = Nowhere::new(area);
    records(rasterizer, &mut target, Primitives::list(), positions, values)
}

/// A framebuffer without memory.
#[derive(Debug)]
pub(crate) struct Nowhere {
    area: Rect,
    pixels: [(); 1 << 15],
    depths: [(); 1 << 15],
}

impl Nowhere {
    pub(crate) fn new(area: Rect) -> Self {
        Self { area, pixels: [(); 1 << 15], depths: [(); 1 << 15] }
    }
}

impl Framebuffer for Nowhere {
    type Color = ();
    type Depth = ();

    fn area(&self) -> Rect {
        self.area
    }

    fn run(&mut self, _: i32, _: i32, len: usize) -> halfplane::Run<'_, (), ()> {
        halfplane::Run { color: &mut self.pixels[..len], depth: &mut self.depths[..len] }
    }
}

/// Vertices on the subpixel grid.
pub(crate) fn projected<const N: usize, V: Varyings, T: DepthTest>(
    rasterizer: &Rasterizer<V, T>,
    positions: [Vec4; N],
) -> [ProjectedVertex; N] {
    let mut room = [ProjectedVertex::default(); N];
    rasterizer.project(&positions, &mut room).expect("there is room");
    room
}

/// Proptest's settings for a number of cases: the same cases every time, so that a test that was green stays green.
///
/// `HALFPLANE_TEST_EFFORT=20` tries twenty times as many, `HALFPLANE_TEST_SEED=7` others.
pub(crate) fn config(cases: u32) -> Config {
    Config {
        cases: effort(cases),
        rng_seed: RngSeed::Fixed(seed()),
        failure_persistence: None,
        max_global_rejects: u32::MAX,
        ..Config::default()
    }
}

/// `count` times the effort asked for.
pub(crate) fn effort(count: u32) -> u32 {
    number("HALFPLANE_TEST_EFFORT")
        .map_or(count, |effort| count.saturating_mul(u32::try_from(effort).unwrap_or(1)))
}

pub(crate) fn seed() -> u64 {
    number("HALFPLANE_TEST_SEED").unwrap_or(1)
}

fn number(variable: &str) -> Option<u64> {
    env::var(variable).ok()?.parse().ok()
}

/// Repeatable random numbers (`SplitMix64`).
#[derive(Clone, Debug)]
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(stream: u64) -> Self {
        Self(seed().wrapping_mul(0x2545_f491_4f6c_dd1d) ^ stream.wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }

    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// An integer in `low ..= high`.
    pub(crate) fn between(&mut self, low: i32, high: i32) -> i32 {
        let count = u64::from(high.abs_diff(low)) + 1;
        low.wrapping_add_unsigned(u32::try_from(((self.bits() >> 32) * count) >> 32).expect("below 2³²"))
    }

    /// A number in 0 .. 1.
    pub(crate) fn unit(&mut self) -> f32 {
        self.between(0, (1 << 24) - 1) as f32 / (1 << 24) as f32
    }

    /// A number in `low .. high`.
    pub(crate) fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    pub(crate) fn choose<T: Copy>(&mut self, from: &[T]) -> T {
        from[usize::try_from(self.between(0, i32::try_from(from.len()).expect("few") - 1))
            .expect("not negative")]
    }

    pub(crate) fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            let j = self.between(0, i32::try_from(i).expect("few"));
            items.swap(i, usize::try_from(j).expect("not negative"));
        }
    }
}
