//! The law of dispatch: a draw that is compiled for more than the crate is, as a function with AVX2 or AVX-512 is, gives the same
//! bits. With the feature `dispatch` and without: `cargo test --features dispatch --test dispatch`.
//!
//! Where the processor has neither, both are the same code, and this says nothing.

mod common;

use common::{Frame, Mixed, Random, Record};
use glam::Vec4;
use halfplane::{
    CoarseDepth, Flat, Fragment, Less, NoPerspective, Primitives, Rasterizer, Rect, Statistics, Surface,
};
use multiversion::multiversion;

/// Rows longer than those that share packets.
const FRAME: Frame = Frame::new(150, 90);

/// Triangles of all sizes, some clipped, and meshes of small ones.
struct Scene {
    positions: Vec<Vec4>,
    values: Vec<Mixed>,
}

impl Scene {
    fn new(random: &mut Random) -> Self {
        let (mut positions, mut values) = (Vec::new(), Vec::new());
        for _ in 0..6 {
            let (more, of_them) = FRAME.triangles(random);
            positions.extend(more);
            values.extend(of_them);
        }
        // Each cell of a grid as two triangles, of one sample or of some fifty.
        let size = random.range(0.7, 9.0);
        let (left, top) = (random.range(0.0, 100.0), random.range(0.0, 60.0));
        for cell in 0..100u8 {
            let (x, y) = (left + size * f32::from(cell % 10), top + size * f32::from(cell / 10));
            let corner = |dx: f32, dy: f32| FRAME.place(x + dx * size, y + dy * size, 0.4, 1.0 + 0.1 * dy);
            let (a, b, c, d) = (corner(0.0, 0.0), corner(0.0, 1.0), corner(1.0, 0.0), corner(1.0, 1.0));
            positions.extend([a, b, c, c, b, d]);
            values.extend((0u8..6).map(|i| common::mixed(f32::from(i), x, u32::from(cell))));
        }
        Self { positions, values }
    }
}

/// Memory after some draws, and what they counted.
type Drawn = (Vec<u32>, Vec<u32>, Vec<u16>, Vec<Statistics>);

/// A number of all that a closure can get cheaply. Small enough to become SIMD.
#[inline(always)]
fn mix(fragment: &Fragment<'_, Mixed>) -> u32 {
    let ([u, v], NoPerspective(n), Flat(flat)) = fragment.varyings();
    let bits = u.to_bits() ^ v.to_bits().rotate_left(7) ^ n.to_bits().rotate_left(13);
    bits ^ fragment.inv_w().to_bits().rotate_left(19) ^ flat ^ fragment.x().unsigned_abs() << 8
}

/// With each kind of draw, over one another.
#[inline(always)]
fn draw(scene: &Scene) -> Drawn {
    let Scene { positions, values } = scene;
    let (mut colors, mut depths, mut shadows) =
        (vec![0u32; FRAME.len()], vec![1.0f32; FRAME.len()], vec![u16::MAX; FRAME.len()]);
    let mut bounds = vec![1.0; CoarseDepth::bounds_len(FRAME.area())];
    let mut counted = Vec::new();
    let rasterizer = Rasterizer::<Mixed>::new(FRAME.viewport());
    let list = Primitives::list();
    {
        let surface = Surface::with_planes(&mut colors[..], &mut depths[..], FRAME.area(), 150);
        let mut target = CoarseDepth::new(surface.expect("it fits"), &mut bounds, Less).expect("long enough");
        counted.push(rasterizer.draw(
            &mut target,
            list,
            &positions[..],
            &values[..],
            #[inline(always)]
            |fragment| mix(&fragment),
        ));
    }
    depths.fill(1.0);
    let mut target = Surface::new(&mut colors, &mut depths, FRAME.width, FRAME.height).expect("it fits");
    counted.push(rasterizer.draw_over(
        &mut target,
        list,
        &positions[..],
        &values[..],
        #[inline(always)]
        |fragment, below| {
            let mixed = mix(&fragment) ^ below;
            (mixed & 7 != 5).then_some(mixed)
        },
    ));
    // A closure that may read, and two stages.
    let table: Vec<u32> = (0..256u32).map(|i| i.wrapping_mul(0x9e37_79b1)).collect();
    let mut later = rasterizer.with_depth_test(halfplane::LessOrEqual);
    later.scissor = Some(Rect { x: 7, y: 5, width: 120, height: 70 });
    counted.push(later.draw(
        &mut target,
        list,
        &positions[..],
        &values[..],
        #[inline(always)]
        |fragment| table[mix(&fragment) as usize & 255],
    ));
    let staged = later.staged(
        #[inline(always)]
        |fragment: Fragment<'_, Mixed>| (mix(&fragment), fragment.varyings_dx().0[0]),
    );
    counted.push(staged.draw_over(
        &mut target,
        list,
        &positions[..],
        &values[..],
        #[inline(always)]
        |(mixed, dx): (u32, f32), below| table[mixed as usize & 255] ^ dx.to_bits() ^ below,
    ));
    let mut shadow = Surface::depth_only(&mut shadows, FRAME.width, FRAME.height).expect("it fits");
    counted.push(Rasterizer::<()>::new(FRAME.viewport()).draw_depth(&mut shadow, list, &positions[..]));
    let counted = counted.into_iter().map(|counted| counted.expect("legal input")).collect();
    (colors, depths.into_iter().map(f32::to_bits).collect(), shadows, counted)
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2+fma+lzcnt+popcnt", "x86+avx2+fma"))]
fn draw_for_avx2(scene: &Scene) -> Drawn {
    draw(scene)
}

#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+bmi1+bmi2+fma+lzcnt+popcnt"
))]
fn draw_for_avx512(scene: &Scene) -> Drawn {
    draw(scene)
}

/// For what the crate is compiled for.
#[inline(never)]
fn draw_plain(scene: &Scene) -> Drawn {
    draw(scene)
}

#[test]
fn a_dispatched_draw_gives_the_same_bits() {
    let mut random = Random::new(0xd15b);
    let mut passed = 0;
    for case in 0..common::effort(60) {
        let scene = Scene::new(&mut random);
        let expected = draw_plain(&scene);
        assert!(draw_for_avx2(&scene) == expected, "scene {case} with AVX2");
        assert!(draw_for_avx512(&scene) == expected, "scene {case} with AVX-512");
        passed += expected.3.iter().map(|counted| counted.samples_passed).sum::<u64>();
    }
    assert!(passed > 100_000, "{passed} samples are too few to say much");
}

#[test]
fn it_tells_the_closure_the_same() {
    #[multiversion(targets("x86_64+avx2+bmi1+bmi2+fma+lzcnt+popcnt", "x86+avx2+fma"))]
    fn for_avx2(scene: &Scene) -> Vec<Record> {
        tell(scene)
    }
    #[inline(always)]
    fn tell(scene: &Scene) -> Vec<Record> {
        let rasterizer = Rasterizer::<Mixed>::new(FRAME.viewport());
        let mut target = common::Nowhere::new(FRAME.area());
        let mut records = Vec::new();
        let (positions, values) = (&scene.positions[..], &scene.values[..]);
        let drawn = rasterizer.draw(
            &mut target,
            Primitives::list(),
            positions,
            values,
            #[inline(always)]
            |fragment| records.push(Record::of(&fragment)),
        );
        drawn.expect("legal input");
        records
    }
    let mut random = Random::new(0x7e11);
    for case in 0..common::effort(20) {
        let scene = Scene::new(&mut random);
        assert!(for_avx2(&scene) == tell(&scene), "scene {case}");
    }
}
