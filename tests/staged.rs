//! The law of shading in two stages: nothing but time depends on it. Memory and statistics are those of one closure that does
//! both, for each of the four draws and any framebuffer; and the closures see fragments, and nothing else.

mod common;

use core::cell::RefCell;
use std::collections::BTreeSet;

use common::{Frame, Mixed, Random, Record as Told, config};
use glam::Vec4;
use halfplane::{
    CoarseDepth, CompareOp, DepthState, Flat, Fragment, Framebuffer, Less, NoPerspective, Primitives,
    Rasterizer, Record, Rect, Run, Statistics, Surface,
};
use proptest::prelude::*;

/// Rows longer than a packet.
const WIDE: Frame = Frame::new(300, 24);
const SMALL: Frame = Frame::new(48, 40);

/// Lends no blocks, and in some places less than it is asked for.
struct Miserly<F>(F);

impl<F: Framebuffer> Framebuffer for Miserly<F> {
    type Color = F::Color;
    type Depth = F::Depth;

    fn area(&self) -> Rect {
        self.0.area()
    }

    fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, F::Color, F::Depth> {
        self.0.run(x, y, if (x ^ y) & 7 == 5 { len.min(11) } else { len })
    }
}

/// What is handed on: of each kind something.
type Between = (f32, [u32; 2], (Vec4, bool));

/// All that a fragment tells, in parts.
fn first(fragment: Fragment<'_, Mixed>) -> Between {
    let ([u, v], NoPerspective(n), Flat(flat)) = fragment.varyings();
    let dx = fragment.varyings_dx().0[0];
    let [a, b, c] = fragment.weights();
    let place = fragment.x().unsigned_abs() << 16 ^ fragment.y().unsigned_abs();
    let which = flat ^ fragment.primitive_index() << 8;
    (u + dx, [place, which], (Vec4::new(v, n, a - b, c + fragment.depth()), fragment.is_front_facing()))
}

/// A mix of them all and of the colour before. One of sixteen is discarded.
fn second((x, [place, which], (v, is_front)): Between, below: u32) -> Option<u32> {
    let mut hash = below ^ place.wrapping_mul(0x9e37_79b1) ^ which ^ u32::from(is_front);
    for number in [x, v.x, v.y, v.z, v.w] {
        hash = (hash.rotate_left(7) ^ number.to_bits()).wrapping_mul(0x85eb_ca6b);
    }
    (hash >> 28 != 3).then_some(hash)
}

/// Triangles, and where and how they are drawn.
struct Scene {
    frame: Frame,
    positions: Vec<Vec4>,
    values: Vec<Mixed>,
    way: i32,
    target: i32,
    memory: (Vec<u32>, Vec<u16>),
    rasterizer: Rasterizer<Mixed, DepthState>,
}

impl Scene {
    fn new(seed: u64) -> Self {
        let random = &mut Random::new(seed);
        let frame = random.choose(&[WIDE, SMALL]);
        let (mut positions, mut values) = frame.triangles(random);
        for _ in 0..random.between(0, 30) {
            // Of a few pixels, or of one.
            let size = random.choose(&[0.7, 3.0, 9.0]);
            let [x, y] = [frame.width, frame.height].map(|size| random.unit() * size as f32);
            for _ in 0..3 {
                let [x, y] = [x, y].map(|c| c + random.range(-size, size));
                positions.push(frame.place(x, y, random.unit(), random.choose(&[1.0, 2.5])));
                values.push(common::mixed(random.unit(), random.unit(), random.between(0, 9).unsigned_abs()));
            }
        }
        let compare =
            random.choose(&[CompareOp::Less, CompareOp::Less, CompareOp::Greater, CompareOp::Always]);
        let test = DepthState { compare, write: random.between(0, 3) > 0 };
        let mut rasterizer = Rasterizer::new(frame.viewport()).with_depth_test(test);
        if random.between(0, 3) == 0 {
            rasterizer.scissor = Some(Rect { x: random.between(-9, 30), y: 5, width: 20, height: 20 });
        }
        let depths = if random.between(0, 2) == 0 { [0, u16::MAX] } else { [0x8000; 2] };
        // Noise, so that of most rows some fragments pass.
        let memory =
            ((0..).take(frame.len()).collect(), (0..frame.len()).map(|_| random.choose(&depths)).collect());
        let (way, target) = (random.between(0, 3), random.between(0, 3));
        Self { frame, positions, values, way, target, memory, rasterizer }
    }

    /// Memory and statistics after a draw into one of the framebuffers, in one stage or two.
    fn memory_after(&self, is_staged: bool) -> (Vec<u32>, Vec<u16>, Statistics) {
        let (mut colors, mut depths) = self.memory.clone();
        let Frame { width, height } = self.frame;
        let surface = Surface::new(&mut colors[..], &mut depths[..], width, height).expect("it fits");
        let statistics = match self.target {
            0 => self.draw(&mut { surface }, is_staged),
            1 => self.draw(&mut Miserly(surface), is_staged),
            2 => surface.bands(7).map(|mut band| self.draw(&mut band, is_staged)).fold(
                Statistics::default(),
                |mut sum, one| {
                    sum += one;
                    sum
                },
            ),
            _ => {
                // True of any depths that are compared for less.
                let mut bounds = vec![u16::MAX; CoarseDepth::bounds_len(self.frame.area())];
                self.draw(&mut CoarseDepth::new(surface, &mut bounds, Less).expect("enough"), is_staged)
            }
        };
        (colors, depths, statistics)
    }

    /// In one of the four ways.
    fn draw<F: Framebuffer<Color = u32>>(&self, target: &mut F, is_staged: bool) -> Statistics {
        let Self { rasterizer, positions, values, .. } = self;
        let (list, positions, values) = (Primitives::list(), &positions[..], &values[..]);
        let mut records = vec![Record::blank(common::mixed(0.0, 0.0, 0)); positions.len()];
        let mut preparation = rasterizer.prepare(target.area(), list, positions, values).expect("legal");
        let batch = preparation.fill(&mut records).expect("there is room").unwrap_or_default();
        let staged = rasterizer.staged(first);
        match (self.way, is_staged) {
            (0, false) => {
                rasterizer.draw(target, list, positions, values, |f| second(first(f), 0)).expect("legal")
            }
            (0, true) => {
                staged.draw(target, list, positions, values, |between| second(between, 0)).expect("legal")
            }
            (1, false) => rasterizer
                .draw_over(target, list, positions, values, |f, below| second(first(f), below))
                .expect("legal"),
            (1, true) => staged.draw_over(target, list, positions, values, second).expect("legal"),
            (2, false) => rasterizer.draw_prepared(target, batch, |f| second(first(f), 0)),
            (2, true) => staged.draw_prepared(target, batch, |between| second(between, 0)),
            (_, false) => rasterizer.draw_prepared_over(target, batch, |f, below| second(first(f), below)),
            (_, true) => staged.draw_prepared_over(target, batch, second),
        }
    }
}

proptest! {
    #![proptest_config(config(1000))]

    #[test]
    fn memory_is_that_of_one_closure(seed in any::<u64>()) {
        let scene = Scene::new(seed);
        let (one, two) = (scene.memory_after(false), scene.memory_after(true));
        prop_assert_eq!(one.2, two.2, "statistics of way {} into {}", scene.way, scene.target);
        prop_assert!(one.0 == two.0, "colours of way {} into {}", scene.way, scene.target);
        prop_assert!(one.1 == two.1, "depths of way {} into {}", scene.way, scene.target);
    }

    /// Which fragments the closures see, each number of them, and over which colour; and perhaps some of them again.
    #[test]
    fn closures_see_every_fragment_and_nothing_else(seed in any::<u64>()) {
        let scene = Scene::new(seed);
        let (list, positions, values) = (Primitives::list(), &scene.positions[..], &scene.values[..]);
        let Frame { width, height } = scene.frame;
        // As many layers as there are: so each colour says how often its pixel was drawn.
        let (mut colors, mut depths) = (vec![0u8; scene.frame.len()], scene.memory.1.clone());
        let mut target = Surface::new(&mut colors, &mut depths, width, height).expect("it fits");
        let mut expected = BTreeSet::new();
        scene.rasterizer.draw_over(&mut target, list, positions, values, |f, below| {
            expected.insert((Told::of(&f), below));
            below + 1
        }).expect("legal");

        let (mut again, mut depths) = (vec![0u8; scene.frame.len()], scene.memory.1.clone());
        let mut target = Surface::new(&mut again, &mut depths, width, height).expect("it fits");
        let (seen, handed_on) = (RefCell::new(Vec::new()), RefCell::new(BTreeSet::new()));
        let staged = scene.rasterizer.staged(|f| {
            seen.borrow_mut().push(Told::of(&f));
            seen.borrow().len() - 1
        });
        staged.draw_over(&mut target, list, positions, values, |number, below| {
            handed_on.borrow_mut().insert((seen.borrow()[number], below));
            below + 1
        }).expect("legal");
        let seen: BTreeSet<Told> = seen.borrow().iter().copied().collect();
        prop_assert_eq!(seen, expected.iter().map(|(told, _)| *told).collect(), "by the first");
        prop_assert_eq!(&*handed_on.borrow(), &expected, "by the second");
        prop_assert_eq!(again, colors, "layers");
    }
}
