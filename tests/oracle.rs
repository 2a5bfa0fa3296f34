//! The specification's formulas at their plainest, at every pixel, against which the fast path runs.
//!
//! * **Coverage**: `i128`, and not the top-left rule itself but what it stands for. A sample that lies on an edge belongs
//!   to the side that it would fall on if it were moved to the right by next to nothing, and down by still less. Whether
//!   the moved sample lies inside is decided by counting the edges that a ray from it crosses.
//! * **Barycentrics**: quotients of exact integers. **Weights, depth, derivatives, values**: `f64` from these.
//!
//! Both start at the vertices on the subpixel grid, which [`Rasterizer::project`] tells: from there on the triangle *is*
//! the one with these corners.
//!
//! The bounds asserted are those that the crate documents, or as wide; the worst of 22 000 000 fragments is a third of them; `-- --nocapture` prints this run's.

mod common;

use common::{Mixed, Nowhere, Random, Record, effort, mixed, projected, records, records_of};
use glam::Vec4;
use halfplane::{
    CullMode, Flat, Less, NoPerspective, Primitives, ProjectedVertex, Rasterizer, Rect, SUBPIXELS, Setup,
    Viewport,
};

/// A triangle on the subpixel grid, as the specification sees it.
struct Oracle {
    corners: [[i64; 2]; 3],
    /// Barycentrics times this are integers. Positive when the corners turn clockwise as displayed.
    area2: i128,
    depth: [f64; 3],
    inv_w: [f64; 3],
}

/// What there is to know about a sample.
struct Truth {
    barycentrics: [f64; 3],
    weights: [f64; 3],
    /// Derivatives of the weights by x and y, a pixel.
    weights_dx: [f64; 3],
    weights_dy: [f64; 3],
    /// The size of the terms that these derivatives are differences of.
    scale_dx: f64,
    scale_dy: f64,
    barycentrics_dx: [f64; 3],
    barycentrics_dy: [f64; 3],
    depth: f64,
    inv_w: f64,
}

fn edge([px, py]: [i64; 2], [qx, qy]: [i64; 2], [sx, sy]: [i64; 2]) -> i128 {
    let area = |a: i64, b: i64| i128::from(a) * i128::from(b);
    area(qx - px, sy - py) - area(qy - py, sx - px)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Oracle {
    fn new(vertices: [ProjectedVertex; 3]) -> Self {
        let corners = vertices.map(|v| v.position_subpixel().expect("inside the guard band").map(i64::from));
        let [a, b, c] = corners;
        Self {
            corners,
            area2: edge(a, b, c),
            depth: vertices.map(|v| v.depth().into()),
            inv_w: vertices.map(|v| v.inv_w().into()),
        }
    }

    fn sample(x: i32, y: i32) -> [i64; 2] {
        [x, y].map(|i| i64::from(i) * i64::from(SUBPIXELS) + i64::from(SUBPIXELS) / 2)
    }

    /// How often the outline winds around the sample, moved right by ε and down by ε².
    fn winding(&self, x: i32, y: i32) -> i32 {
        let sample = Self::sample(x, y);
        let [a, b, c] = self.corners;
        let mut winding = 0;
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let (p_is_above, q_is_above) = (p[1] <= sample[1], q[1] <= sample[1]);
            let side = edge(p, q, sample);
            // A ray to the right meets an edge downwards if the sample lies left of it, strictly: it was moved right.
            if p_is_above && !q_is_above && side > 0 {
                winding += 1;
            } else if !p_is_above && q_is_above && side < 0 {
                winding -= 1;
            }
        }
        winding
    }

    /// The three edge functions over twice the area, at the sample and as slopes a pixel.
    #[expect(clippy::cast_precision_loss, reason = "that is the rounding that is meant")]
    fn quotients(&self, x: i32, y: i32) -> ([f64; 3], [f64; 3], [f64; 3]) {
        let [a, b, c] = self.corners;
        let edges = [(b, c), (c, a), (a, b)];
        let over_area = |e: i128| e as f64 / self.area2 as f64;
        let at = |x: i32, y: i32| edges.map(|(p, q)| edge(p, q, Self::sample(x, y)));
        let (here, right, below) = (at(x, y), at(x + 1, y), at(x, y + 1));
        let slope = |there: [i128; 3]| [0, 1, 2].map(|i| over_area(there[i] - here[i]));
        (here.map(over_area), slope(right), slope(below))
    }

    fn truth(&self, x: i32, y: i32) -> Truth {
        let (barycentrics, barycentrics_dx, barycentrics_dy) = self.quotients(x, y);
        let over_w = |b: [f64; 3]| [0, 1, 2].map(|i| b[i] * self.inv_w[i]);
        let parts = over_w(barycentrics);
        let inv_w: f64 = parts.iter().sum();
        let weights = parts.map(|part| part / inv_w);
        let derivative = |step: [f64; 3]| {
            let parts = over_w(step);
            let whole: f64 = parts.iter().sum();
            let scale = parts.iter().map(|part| part.abs()).sum::<f64>() / inv_w;
            ([0, 1, 2].map(|i| (parts[i] - weights[i] * whole) / inv_w), scale)
        };
        let ((weights_dx, scale_dx), (weights_dy, scale_dy)) =
            (derivative(barycentrics_dx), derivative(barycentrics_dy));
        Truth {
            depth: dot(barycentrics, self.depth),
            barycentrics,
            weights,
            weights_dx,
            weights_dy,
            scale_dx,
            scale_dy,
            barycentrics_dx,
            barycentrics_dy,
            inv_w,
        }
    }
}

/// The largest errors seen, in units of 2⁻²⁰ of what each is measured by.
#[derive(Debug, Default)]
struct Worst {
    fragments: usize,
    /// Absolute.
    weights: f64,
    sum_of_weights: f64,
    outside_of_0_to_1: f64,
    barycentrics: f64,
    depth: f64,
    /// Of its own size.
    inv_w: f64,
    /// Of the largest difference of two vertices' values.
    values: f64,
    /// Of the terms that the derivative is a difference of, times the largest difference of two values.
    derivatives: f64,
}

const UNIT: f64 = 1.0 / (1 << 20) as f64;

impl Worst {
    fn note(worst: &mut f64, error: f64) {
        let error = error.abs() / UNIT;
        assert!(!error.is_nan(), "a number is none");
        *worst = worst.max(error);
    }

    fn compare(&mut self, record: &Record, truth: &Truth, [a, b, c]: [Mixed; 3]) {
        let float = |bits: u32| f64::from(f32::from_bits(bits));
        self.fragments += 1;
        let weights = record.weights.map(float);
        let barycentrics = record.barycentrics.map(float);
        for i in 0..3 {
            Self::note(&mut self.weights, weights[i] - truth.weights[i]);
            Self::note(&mut self.outside_of_0_to_1, (weights[i] - 0.5).abs().max(0.5) - 0.5);
            Self::note(&mut self.barycentrics, barycentrics[i] - truth.barycentrics[i]);
        }
        Self::note(&mut self.sum_of_weights, weights.iter().sum::<f64>() - 1.0);
        Self::note(&mut self.depth, float(record.depth) - truth.depth);
        Self::note(&mut self.inv_w, float(record.inv_w) / truth.inv_w - 1.0);

        // The values at the vertices: two smooth ones, and one that is linear on the screen.
        let at_vertices: [[f64; 3]; 3] =
            [0, 1, 2].map(|i| [a, b, c].map(|([u, v], NoPerspective(n), _)| f64::from([u, v, n][i])));
        for (i, values) in at_vertices.into_iter().enumerate() {
            let (weights, dx, dy, scale_dx, scale_dy) = if i < 2 {
                (truth.weights, truth.weights_dx, truth.weights_dy, truth.scale_dx, truth.scale_dy)
            } else {
                let scale = |b: [f64; 3]| b.iter().map(|b| b.abs()).sum::<f64>();
                let (dx, dy) = (truth.barycentrics_dx, truth.barycentrics_dy);
                (truth.barycentrics, dx, dy, scale(dx), scale(dy))
            };
            let [p, q, r] = values;
            let range = (p - q).abs().max((q - r).abs()).max((r - p).abs());
            if range > 0.0 {
                // The value itself is rounded, too.
                let size = range + p.abs().max(q.abs()).max(r.abs());
                Self::note(&mut self.values, (float(record.values[i]) - dot(weights, values)) / size);
                let error = float(record.values_dx[i]) - dot(dx, values);
                Self::note(&mut self.derivatives, error / (range * scale_dx.max(f64::MIN_POSITIVE)));
                let error = float(record.values_dy[i]) - dot(dy, values);
                Self::note(&mut self.derivatives, error / (range * scale_dy.max(f64::MIN_POSITIVE)));
            }
        }
        let Flat(flat) = a.2;
        assert_eq!(record.values[3], flat, "the first vertex provokes");
    }

    fn check(&self) {
        println!("worst errors in 2⁻²⁰: {self:#?}");
        // Documented: weights, their sum and their range are within 2⁻²⁰.
        assert!(self.weights <= 1.0, "weights are within 2⁻²⁰: {self:#?}");
        assert!(self.sum_of_weights <= 1.0, "weights sum to 1 within 2⁻²⁰: {self:#?}");
        assert!(self.outside_of_0_to_1 <= 1.0, "weights lie in 0 ..= 1 within 2⁻²⁰: {self:#?}");
        assert!(self.barycentrics <= 1.0, "barycentrics are within 2⁻²⁰: {self:#?}");
        assert!(self.depth <= 1.0, "depths are within 2⁻²⁰: {self:#?}");
        assert!(self.inv_w <= 1.0, "1/w is within 2⁻²⁰ of itself: {self:#?}");
        assert!(self.values <= 1.0, "values are within 2⁻²⁰ of their range: {self:#?}");
        assert!(self.derivatives <= 2.0, "derivatives are within 2⁻¹⁹ of their terms: {self:#?}");
    }
}

/// One triangle, by every way there is to draw it, against the oracle in a window of the frame.
fn check(rasterizer: &Rasterizer<Mixed>, positions: [Vec4; 3], window: Rect, worst: &mut Worst) {
    let vertices = projected(rasterizer, positions);
    let oracle = Oracle::new(vertices);
    let values = [mixed(1.0, -3.0, 7), mixed(2.5, 100.0, 8), mixed(-1.5, 0.125, 9)];

    // The window may reach out of the viewport, where nothing is drawn.
    let area = rasterizer.render_area(&Nowhere::new(window));
    let covered: Vec<[i32; 2]> = (area.y..area.bottom())
        .flat_map(|y| (area.x..area.right()).map(move |x| [x, y]))
        .filter(|&[x, y]| oracle.winding(x, y) != 0)
        .collect();
    for &[x, y] in &covered {
        let sign = if oracle.area2 > 0 { 1 } else { -1 };
        assert_eq!(oracle.winding(x, y), sign, "once around, the way that the area says");
    }

    // Drawn directly.
    let drawn = records_of(rasterizer, window, &positions, &values);
    let pixels: Vec<[i32; 2]> = drawn.iter().map(|record| [record.x, record.y]).collect();
    assert_eq!(pixels, covered, "{positions:?} at {vertices:?}");
    for record in &drawn {
        assert_eq!(record.is_front_facing, oracle.area2 < 0, "counter-clockwise is front: {vertices:?}");
        worst.compare(record, &oracle.truth(record.x, record.y), values);
    }

    // Projected first, and with indices.
    let mut room = [ProjectedVertex::default(); 3];
    let before = rasterizer.project(&positions, &mut room).expect("there is room");
    let indexed = Primitives::list().indexed(&[0u8, 1, 2]);
    let again = records(rasterizer, &mut Nowhere::new(window), indexed, before, values);
    assert_eq!(drawn, again, "{vertices:?}");

    // Traversed without a rasterizer.
    let Some(setup) = Setup::new(vertices) else {
        assert_eq!(oracle.area2, 0, "only what has no area is refused: {vertices:?}");
        return;
    };
    assert_eq!(i128::from(setup.area2()), oracle.area2.abs(), "{vertices:?}");
    let mut pixels = Vec::new();
    setup.for_each_span(area, |span| {
        assert!(span.start() < span.end(), "no span is empty: {span:?}");
        for (edge, at_anchor) in setup.edges().iter().zip(span.edges()) {
            assert_eq!(
                edge.at(span.anchor(), span.y()) as f32,
                at_anchor,
                "rounded once: {span:?} {vertices:?}"
            );
        }
        pixels.extend((span.start()..span.end()).map(|x| [x, span.y()]));
    });
    assert_eq!(pixels, covered, "{vertices:?}");
}

/// 4096 × 4096 pixels around (0, 0): grid points are exact, and the guard band is eight viewports wide.
fn rasterizer() -> Rasterizer<Mixed> {
    let viewport = Viewport::new(-2048.0, -2048.0, 4096.0, 4096.0).expect("a legal viewport");
    let mut rasterizer = Rasterizer::new(viewport);
    rasterizer.cull_mode = CullMode::None;
    rasterizer
}

fn place([x, y]: [f32; 2], depth: f32, w: f32) -> Vec4 {
    Vec4::new(x / 2048.0, -y / 2048.0, depth, 1.0) * w
}

/// Runs triangles whose corners a function draws, in pixels, in a window 36 × 28 around the first corner or (0, 0).
fn run(stream: u64, count: u32, w: &[f32], corners: impl Fn(&mut Random) -> [[f32; 2]; 3]) {
    let (mut random, mut worst, rasterizer) = (Random::new(stream), Worst::default(), rasterizer());
    for _ in 0..effort(count) {
        let corners = corners(&mut random);
        let positions = corners.map(|corner| place(corner, random.unit(), random.choose(w)));
        let centre = random.choose(&[corners[0], [0.0, 0.0]]);
        let [x, y] = centre.map(|c| halfplane::floor_to_i32(c.clamp(-2048.0, 2048.0)));
        let window =
            Rect { x: x - random.between(0, 35), y: y - random.between(0, 27), width: 36, height: 28 };
        check(&rasterizer, positions, window, &mut worst);
    }
    worst.check();
}

const EQUAL_W: &[f32] = &[1.0];
const SOME_W: &[f32] = &[0.5, 1.0, 1.0, 2.0, 3.7, 10.0, 25.3];
const ANY_W: &[f32] = &[1e-9, 1e-4, 0.1, 1.0, 7.0, 1e3, 1e7, 1e12];

/// A point of a grid of `step` pixels, at most `reach` pixels from the middle.
fn grid_point(random: &mut Random, step: f32, reach: i32) -> [f32; 2] {
    [0, 1].map(|_| random.between(-reach, reach) as f32 * step)
}

#[test]
fn corners_on_the_half_pixel_grid() {
    run(1, 500, SOME_W, |random| [0, 1, 2].map(|_| grid_point(random, 0.5, 24)));
}

#[test]
fn corners_on_the_subpixel_grid() {
    run(2, 300, SOME_W, |random| [0, 1, 2].map(|_| grid_point(random, 1.0 / 256.0, 20 * 256)));
}

#[test]
fn corners_anywhere_and_any_w() {
    run(3, 300, ANY_W, |random| [0, 1, 2].map(|_| [0, 1].map(|_| random.range(-30.0, 30.0))));
}

#[test]
fn triangles_of_a_few_samples() {
    run(4, 800, SOME_W, |random| {
        let at = grid_point(random, 0.5, 3000);
        let step = random.choose(&[1.0 / 256.0, 0.25, 0.5]);
        [0, 1, 2].map(|_| {
            let [x, y] = grid_point(random, step, if step < 0.1 { 400 } else { 4 });
            [at[0] + x, at[1] + y]
        })
    });
}

#[test]
fn needles_from_sample_to_sample() {
    // Long edges at rational slopes with many samples exactly on them, and a third corner next to nothing away.
    run(5, 500, SOME_W, |random| {
        let [x, y] = grid_point(random, 1.0, 20).map(|c| c + 0.5);
        let [dx, dy] = grid_point(random, 1.0, 5);
        let (k, m) = (random.between(1, 8) as f32, random.between(1, 8) as f32);
        let off = grid_point(random, 1.0 / 256.0, 2);
        [[x, y], [x + dx * k, y + dy * k], [x - dx * m + off[0], y - dy * m + off[1]]]
    });
}

#[test]
fn slivers_that_reach_to_the_guard_band() {
    run(6, 400, SOME_W, |random| {
        let near = [0, 1].map(|_| random.range(-20.0, 20.0));
        let far = [0, 1].map(|_| random.range(-16_380.0, 16_380.0));
        let [x, y] = grid_point(random, 1.0 / 256.0, 600);
        [near, far, [far[0] + x, far[1] + y].map(|c| c.clamp(-16_383.0, 16_383.0))]
    });
}

#[test]
fn triangles_as_large_as_the_guard_band() {
    run(7, 300, ANY_W, |random| {
        [0, 1, 2].map(|_| {
            let at = [0, 1].map(|_| random.range(-16_383.0, 16_383.0));
            let on_border = random.choose(&[-16_383.0, 16_383.0]);
            random.choose(&[at, [at[0], on_border], [on_border, at[1]], [on_border, on_border]])
        })
    });
}

#[test]
fn triangles_just_small_and_just_large_enough_for_the_other_path() {
    // Where fragments start to be measured from an anchor: extents of 16 pixels. And where the way of solving rows changes,
    // which nobody may notice: 181 pixels.
    run(8, 600, SOME_W, |random| {
        let [x, y] = grid_point(random, 1.0 / 256.0, 256 * 20);
        let limit = random.choose(&[16.0, 181.0]);
        let extent = limit + random.between(-3, 3) as f32 / 256.0;
        let third = [random.range(-limit / 8.0, limit), random.range(0.0, limit)];
        let second = random.choose(&[[x + extent, y], [x, y + extent], [x + extent, y + extent]]);
        [[x, y], second, [x + third[0], y + third[1]]]
    });
}

#[test]
fn equal_w_makes_weights_of_barycentrics() {
    let mut random = Random::new(9);
    let rasterizer = rasterizer();
    for _ in 0..effort(60) {
        let positions = [0, 1, 2].map(|_| place(grid_point(&mut random, 0.5, 30), random.unit(), EQUAL_W[0]));
        let values = [mixed(0.0, 0.0, 1); 3];
        for record in
            records_of(&rasterizer, Rect { x: -16, y: -16, width: 32, height: 32 }, &positions, &values)
        {
            for (weight, barycentric) in record.weights.iter().zip(record.barycentrics) {
                let difference = f32::from_bits(*weight) - f32::from_bits(barycentric);
                assert!(difference.abs() < 1.0 / (1 << 20) as f32, "{record:?}");
            }
        }
    }
}

#[test]
fn the_depth_test_sees_the_depth_that_the_fragment_tells() {
    let mut random = Random::new(10);
    let viewport = Viewport::of_size(32, 32).expect("a legal viewport");
    let rasterizer = Rasterizer::<()>::new(viewport).with_depth_test(Less);
    for _ in 0..effort(60) {
        let positions = [0, 1, 2].map(|_| {
            let [x, y] = [random.range(-1.5, 1.5), random.range(-1.5, 1.5)];
            Vec4::new(x, y, random.unit(), 1.0) * random.choose(SOME_W)
        });
        let (mut told, mut stored) = ([2.0f32; 1024], [2.0f32; 1024]);
        let mut target = halfplane::Surface::new(&mut told, &mut stored, 32, 32).expect("it fits");
        rasterizer
            .draw(&mut target, Primitives::list(), &positions, (), |fragment| fragment.depth())
            .expect("legal input");
        assert_eq!(told.map(f32::to_bits), stored.map(f32::to_bits), "{positions:?}");
    }
}
