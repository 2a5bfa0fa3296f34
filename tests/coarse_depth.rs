//! The law of coarse depth: it changes nothing but the time. Any draws one after the other, with any depth tests, leave
//! the same memory and tell the same with it and without; and its bounds are true after each.

mod common;

use core::cell::Cell;
use core::fmt::Debug;

use common::{Frame, HAS_SIMD, Random, config};
use glam::Vec4;
use halfplane::{
    CoarseDepth, CompareOp, DepthBias, DepthFormat, DepthState, DepthTest, Fragment, Framebuffer, Less,
    Primitives, Rasterizer, Record, Rect, Run, Statistics, Surface, SurfaceError, Viewport,
};
use proptest::prelude::*;

/// Less, but nobody says so.
#[derive(Clone, Copy, Debug)]
struct Secret;

impl DepthTest for Secret {
    fn passes<D: PartialOrd>(self, new: D, old: D) -> bool {
        new < old
    }
}

/// Mostly large triangles, at depths that others have too, level or steep.
fn triangles(frame: Frame, random: &mut Random) -> Vec<Vec4> {
    let mut positions = Vec::new();
    for _ in 0..random.between(1, 4) {
        let level = random.choose(&[None, Some(0.25), Some(0.5), Some(1.0)]);
        let reach = random.choose(&[5.0, 40.0, 200.0, 3000.0, 40_000.0]);
        let middle = [frame.width, frame.height].map(|size| random.unit() * size as f32);
        for _ in 0..3 {
            let [x, y] = middle.map(|c| c + random.range(-reach, reach));
            let depth = level.unwrap_or_else(|| random.range(-0.2, 1.2));
            positions.push(frame.place(x, y, depth, random.choose(&[1.0, 1.0, 3.0, -0.5])));
        }
    }
    positions
}

/// One draw, in any of the ways there are.
#[derive(Clone, Debug)]
struct Draw {
    positions: Vec<Vec4>,
    /// None for one that does not say what it compares.
    test: Option<DepthState>,
    way: i32,
    discards: i32,
    scissor: Option<Rect>,
    bias: DepthBias,
}

impl Draw {
    fn new(frame: Frame, random: &mut Random) -> Self {
        // Most with a test that bounds are kept for.
        let compare = random.choose(&[
            CompareOp::Less,
            CompareOp::Less,
            CompareOp::LessOrEqual,
            CompareOp::LessOrEqual,
            CompareOp::Greater,
            CompareOp::GreaterOrEqual,
            CompareOp::Equal,
            CompareOp::NotEqual,
            CompareOp::Always,
            CompareOp::Never,
        ]);
        let state = DepthState { compare, write: random.between(0, 3) > 0 };
        let test = (random.between(0, 9) > 0).then_some(state);
        let scissor = (random.between(0, 3) == 0).then(|| Rect {
            x: random.between(-9, 200),
            y: random.between(-3, 9),
            width: 150,
            height: 6,
        });
        let bias = random
            .choose(&[DepthBias::default(), DepthBias { constant: 5.0, slope: 0.5, ..DepthBias::default() }]);
        let (way, discards) = (random.between(0, 3), random.choose(&[0, 0, 0, 1, 50]));
        Self { positions: triangles(frame, random), test, way, discards, scissor, bias }
    }

    fn run<F: Framebuffer<Color = u32>>(&self, target: &mut F, frame: Frame) -> Statistics {
        match self.test {
            None => self.run_with(target, frame, Secret),
            Some(DepthState { compare: CompareOp::Less, write: true }) => self.run_with(target, frame, Less),
            Some(state) => self.run_with(target, frame, state),
        }
    }

    fn run_with<F: Framebuffer<Color = u32>>(
        &self,
        target: &mut F,
        frame: Frame,
        test: impl DepthTest,
    ) -> Statistics {
        let mut rasterizer = Rasterizer::<()>::new(frame.viewport()).with_depth_test(test);
        (rasterizer.scissor, rasterizer.depth_bias) = (self.scissor, self.bias);
        let is_kept = |fragment: &Fragment<'_, ()>| {
            self.discards == 0 || (fragment.x() + fragment.y() * 7) % self.discards != 0
        };
        let shade = |fragment: Fragment<'_, ()>| {
            is_kept(&fragment).then_some(fragment.depth().to_bits() ^ fragment.primitive_index())
        };
        let (list, positions) = (Primitives::list(), self.positions.as_slice());
        match self.way {
            0 => rasterizer.draw(target, list, positions, (), shade).expect("legal"),
            1 => rasterizer
                .draw_over(target, list, positions, (), |fragment, below: u32| {
                    is_kept(&fragment).then_some(below.wrapping_mul(31) ^ fragment.depth().to_bits())
                })
                .expect("legal"),
            2 => rasterizer.draw_depth(target, list, positions).expect("legal"),
            _ => {
                let mut records = [Record::blank(()); 16];
                let mut preparation = rasterizer.prepare(frame.area(), list, positions, ()).expect("legal");
                let batch = preparation.fill(&mut records).expect("there is room").unwrap_or_default();
                rasterizer.draw_prepared(target, batch, shade)
            }
        }
    }
}

/// Whether no depth of a segment lies behind its bound.
fn are_true<D: DepthFormat>(frame: Frame, depth: &[D], bounds: &[D], test: impl DepthTest) -> bool {
    let columns = bounds.len() / frame.height as usize;
    depth.chunks(frame.width as usize).zip(bounds.chunks(columns)).all(|(row, bounds)| {
        row.chunks(64).zip(bounds).all(|(segment, &bound)| {
            segment.iter().all(|&depth| if test.passes(0, 1) { depth <= bound } else { depth >= bound })
        })
    })
}

fn check<D: DepthFormat + Debug>(seed: u64, compare: CompareOp, far: f32) {
    let test = DepthState { compare, write: true };
    let random = &mut Random::new(seed);
    let frame =
        random.choose(&[Frame::new(300, 9), Frame::new(64, 12), Frame::new(700, 5), Frame::new(4500, 3)]);
    let (mut color, mut depth) = (vec![0; frame.len()], vec![D::from_depth(far); frame.len()]);
    let (mut plain_color, mut plain_depth) = (color.clone(), depth.clone());
    let mut bounds = vec![D::from_depth(far); CoarseDepth::bounds_len(frame.area())];
    for number in 0..random.between(2, 12) {
        let draw = Draw::new(frame, random);
        let surface = Surface::new(&mut color, &mut depth, frame.width, frame.height).expect("it fits");
        let mut coarse = CoarseDepth::new(surface, &mut bounds, test).expect("long enough");
        let statistics = draw.run(&mut coarse, frame);
        let mut plain =
            Surface::new(&mut plain_color, &mut plain_depth, frame.width, frame.height).expect("it fits");
        assert_eq!(statistics, draw.run(&mut plain, frame), "draw {number}: {draw:?}");
        assert!(color == plain_color, "colours after draw {number}: {draw:?}");
        assert!(depth == plain_depth, "depths after draw {number}: {draw:?}");
        assert!(are_true(frame, &depth, &bounds, test), "bounds after draw {number}: {draw:?}");
    }
}

proptest! {
    #![proptest_config(config(1500))]

    #[test]
    fn coarse_depth_changes_nothing(seed in any::<u64>()) {
        match seed % 4 {
            0 => check::<f32>(seed, CompareOp::Less, 1.0),
            1 => check::<f32>(seed, CompareOp::Greater, 0.0),
            2 => check::<u16>(seed, CompareOp::LessOrEqual, 1.0),
            _ => check::<u16>(seed, CompareOp::GreaterOrEqual, 0.0),
        }
    }
}

/// Counts the pixels that it lends.
struct Counting<'a, F> {
    target: F,
    lent: &'a Cell<usize>,
}

impl<F: Framebuffer> Framebuffer for Counting<'_, F> {
    type Color = F::Color;
    type Depth = F::Depth;

    fn area(&self) -> Rect {
        self.target.area()
    }

    fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, F::Color, F::Depth> {
        self.lent.set(self.lent.get() + len);
        self.target.run(x, y, len)
    }
}

#[test]
fn what_is_hidden_is_not_read() {
    if !HAS_SIMD {
        return;
    }
    let frame = Frame::new(1000, 20);
    // The last segment of a row is a narrow one; the frame begins left of the origin.
    let area = Rect { x: -500, y: 0, width: 1000, height: 20 };
    let wide = |depth| {
        [[-2000.0, -500.0], [-2000.0, 500.0], [8000.0, 0.0]].map(|[x, y]| frame.place(x, y, depth, 1.0))
    };
    let (mut color, mut depth) = (vec![0u32; frame.len()], vec![0.0f32; frame.len()]);
    let mut bounds = vec![0.0; CoarseDepth::bounds_len(area)];
    let count = Cell::new(0);
    let viewport = Viewport::new(-500.0, 0.0, 1000.0, 20.0).expect("legal");
    let greater = DepthState { compare: CompareOp::Greater, write: true };
    let whole = Rasterizer::<()>::new(viewport).with_depth_test(greater);
    let surface = Surface::with_planes(&mut color[..], &mut depth[..], area, 1000).expect("it fits");
    let mut target = CoarseDepth::new(Counting { target: surface, lent: &count }, &mut bounds, greater)
        .expect("long enough");
    let mut draw = |rasterizer: &Rasterizer<(), DepthState>, depth, depth_only| {
        let before = count.get();
        let (list, positions) = (Primitives::list(), wide(depth));
        if depth_only {
            // A reference to it knows as much.
            rasterizer.draw_depth(&mut &mut target, list, positions).expect("legal");
        } else {
            rasterizer.draw(&mut target, list, &positions, (), |_| 1u32).expect("legal");
        }
        count.get() - before
    };
    let mut left = whole;
    left.scissor = Some(Rect { x: -500, y: 0, width: 512, height: 20 });
    for depth_only in [false, true] {
        let near = if depth_only { 0.75 } else { 0.25 };
        assert!(draw(&whole, near, depth_only) >= frame.len(), "it is seen");
        assert!(draw(&whole, near, depth_only) >= frame.len(), "what is as near is tested");
        assert!(draw(&whole, near - 0.1, depth_only) <= 1, "but one pixel that a draw begins with");
        // A half comes nearer, and what is drawn over both halves does not make that forgotten.
        draw(&left, near + 0.2, depth_only);
        draw(&whole, near + 0.1, depth_only);
        assert!(draw(&left, near + 0.15, depth_only) <= 1, "hidden by the nearest");
    }
    // Nor does a test of the other direction that writes nothing.
    draw(&whole.with_depth_test(DepthState { compare: CompareOp::Less, write: false }), 0.1, true);
    assert!(draw(&whole, 0.1, true) <= 1, "still hidden");
}

#[test]
fn too_few_bounds_are_refused_with_numbers() {
    let (mut color, mut depth) = ([0u32; 300 * 2], [1.0f32; 300 * 2]);
    let mut bounds = [1.0; 15];
    let surface = Surface::new(&mut color, &mut depth, 300, 2).expect("it fits");
    let error = CoarseDepth::new(surface, &mut bounds, Less).map(drop).expect_err("two rows of eight");
    assert_eq!(
        error,
        SurfaceError::TooShort { plane: "bounds", len: 15, needed: 16 },
        "300 pixels are 8 bounds"
    );
}

/// Lends runs that begin at a multiple of 64, and no others.
struct Picky<F>(F);

impl<F: Framebuffer> Framebuffer for Picky<F> {
    type Color = F::Color;
    type Depth = F::Depth;

    fn area(&self) -> Rect {
        self.0.area()
    }

    fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, F::Color, F::Depth> {
        self.0.run(x, y, if x % 64 == 0 { len } else { 0 })
    }
}

#[test]
fn what_is_not_lent_is_not_learnt() {
    let frame = Frame::new(64, 1);
    let (mut color, mut depth, mut bounds) = ([0u32; 64], [1.0f32; 64], [1.0; 4]);
    depth[0] = 0.1;
    let surface = Surface::new(&mut color, &mut depth, 64, 1).expect("it fits");
    let mut target = CoarseDepth::new(Picky(surface), &mut bounds, Less).expect("long enough");
    let all = [[-100.0, -100.0], [-100.0, 100.0], [300.0, 0.0]].map(|point| frame.at(point));
    let rasterizer = Rasterizer::<()>::new(frame.viewport());
    rasterizer.draw(&mut target, Primitives::list(), &all, (), |_| 1u32).expect("legal");
    assert!(are_true(frame, &depth, &bounds, DepthState::default()), "{depth:?} {bounds:?}");
    assert!(depth[63] == 1.0 || !HAS_SIMD, "the run from the second pixel on is not lent");
}

#[test]
fn a_test_without_direction_is_refused() {
    let (mut color, mut depth, mut bounds) = ([0u32; 64], [1.0f32; 64], [1.0; 4]);
    let mut refuse = |compare| {
        let surface = Surface::new(&mut color, &mut depth, 64, 1).expect("it fits");
        let test = DepthState { compare, write: true };
        CoarseDepth::new(surface, &mut bounds, test).map(drop).expect_err("no direction")
    };
    for compare in [CompareOp::Always, CompareOp::NotEqual, CompareOp::Equal, CompareOp::Never] {
        assert_eq!(refuse(compare), SurfaceError::NoDirection { compare: Some(compare) }, "by {compare:?}");
    }
    let surface = Surface::new(&mut color, &mut depth, 64, 1).expect("it fits");
    let error = CoarseDepth::new(surface, &mut bounds, Secret).map(drop).expect_err("no direction");
    assert_eq!(error, SurfaceError::NoDirection { compare: None }, "it does not say");
}

#[test]
fn a_discarded_fragment_leaves_its_pixel_whatever_is_lent() {
    for width in [64, 128] {
        let frame = Frame::new(width, 3);
        let (mut color, mut depth) = (vec![9u32; frame.len()], vec![1.0f32; frame.len()]);
        let surface = Surface::new(&mut color, &mut depth, width, 3).expect("it fits");
        let all = [[-100.0, -100.0], [-100.0, 100.0], [900.0, 0.0]].map(|point| frame.at(point));
        // One that holds something shades elsewhere, and is copied.
        let drawn = core::hint::black_box(1u32);
        Rasterizer::<()>::new(frame.viewport())
            .draw(&mut Picky(surface), Primitives::list(), &all, (), |fragment| {
                (fragment.x() % 7 != 3).then_some(drawn)
            })
            .expect("legal");
        for (i, pixel) in color.iter().zip(&depth).enumerate() {
            let is_kept = i % width as usize % 7 != 3;
            assert_eq!(pixel, if is_kept { (&1, &0.5) } else { (&9, &1.0) }, "pixel {i} of {width}");
        }
    }
}
