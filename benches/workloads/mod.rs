//! The scenes that every benchmark draws: pure geometry and scalar shading.
//!
//! | id | what | bound by |
//! | --- | --- | --- |
//! | W1 | two triangles over the whole screen, w from 1 to 10, 8×8 checker | fill |
//! | W2f, W2b | eight such layers, front to back and back to front | depth rejection, overdraw |
//! | W3 | sphere of 262 144 triangles, 80 % of the height, lambert × checker | small triangles |
//! | W4 | the same with 4 194 304 triangles, half a pixel each | setup, culling |
//! | W5 | W3 without colour | setup, depth |
//! | W6 | a mesh so close that the near plane and the borders cut it, mip-mapped | clipping, derivatives |
//! | W7 | 10 000 triangles of 200 to 2000 pixels, blended | reading back, medium triangles |
//! | W8 | 200 triangles 100 000 pixels wide, half of them slivers | guard band |
//!
//! All are 1920×1080, RGBA8 in a `u32` (red in the lowest byte) and `f32` depth, compared with *less* and
//! written. Depth is z/w in \[0, 1\], y points up in NDC and counter-clockwise triangles are front faces.
//! Every workload has positions in model space and one matrix, so that the vertex transform is always part of
//! the work.
//!
//! Nothing here knows a rasterizer: the contestants of `benches/peers` share this file by its path.

#![allow(
    dead_code,
    unreachable_pub,
    reason = "each program that includes this file draws some of the workloads only"
)]

use glam::camera::rh::{proj::directx::perspective, view::look_at_mat4};
use glam::{Mat4, Quat, Vec2, Vec3, Vec4};

/// Width of every picture, in pixels.
pub const WIDTH: u32 = 1920;
/// Height of every picture, in pixels.
pub const HEIGHT: u32 = 1080;
/// What the colour buffer holds before a frame.
pub const CLEAR_COLOR: u32 = 0xFF30_2018;
/// What the depth buffer holds before a frame.
pub const CLEAR_DEPTH: f32 = 1.0;
/// Distance of the near plane.
pub const NEAR: f32 = 0.5;
/// Distance of the far plane.
pub const FAR: f32 = 32.0;
/// Where the light is, in model space; of length 1.
pub const LIGHT: Vec3 = Vec3::new(0.48, 0.64, 0.6);

/// One picture to draw: a mesh, its matrix, and what happens to each fragment.
#[derive(Clone, Debug)]
pub struct Workload {
    /// "W1", "W2f", …
    pub name: &'static str,
    /// One line for a table.
    pub what: &'static str,
    /// Model to clip space.
    pub transform: Mat4,
    /// Model space, one for each vertex.
    pub positions: Vec<Vec3>,
    /// Three for each triangle.
    pub indices: Vec<u32>,
    /// Whether back faces are skipped; otherwise both sides are drawn.
    pub cull_back: bool,
    /// The varyings and the function that they go to.
    pub shading: Shading,
}

/// What a fragment does, with the varyings that it needs, one for each vertex.
#[derive(Clone, Debug)]
pub enum Shading {
    /// Writes depth only.
    DepthOnly,
    /// [`checker`].
    Checker(Vec<Vec2>),
    /// [`lit_checker`].
    LitChecker(Vec<Lit>),
    /// [`lit_texture`].
    LitTexture(Vec<Lit>, Texture),
    /// [`blend`] with a premultiplied colour.
    Blend(Vec<Vec4>),
}

/// Varyings of a lit, textured surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Lit {
    /// Model space; need not have length 1.
    pub normal: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
}

/// A mesh from outside, with y up; the first three are of one length.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Model space.
    pub positions: Vec<Vec3>,
    /// Outwards.
    pub normals: Vec<Vec3>,
    /// One repeat of the texture a unit.
    pub uvs: Vec<Vec2>,
    /// Three for each triangle, counter-clockwise from outside.
    pub indices: Vec<u32>,
}

impl Workload {
    /// Every workload, in the order of the table.
    pub const NAMES: [&'static str; 9] = ["W1", "W2f", "W2b", "W3", "W4", "W5", "W6", "W7", "W8"];

    /// The workload called `name`, if it is one of [`Self::NAMES`]; `teapot` makes the mesh of W6.
    pub fn new(name: &str, teapot: impl FnOnce() -> Mesh) -> Option<Self> {
        Some(match name {
            "W1" => w1(),
            "W2f" => w2f(),
            "W2b" => w2b(),
            "W3" => w3(),
            "W4" => w4(),
            "W5" => w5(),
            "W6" => w6(teapot()),
            "W7" => w7(),
            "W8" => w8(),
            _ => return None,
        })
    }

    /// The positions in clip space, for benches of the stages behind the vertex transform.
    #[must_use]
    pub fn positions_clip(&self) -> Vec<Vec4> {
        self.positions.iter().map(|p| self.transform * p.extend(1.0)).collect()
    }
}

/// Fill: two triangles over the whole screen.
#[must_use]
pub fn w1() -> Workload {
    layers("W1", "fill: 2 triangles, whole screen", &[0])
}

/// Eight layers, the nearest first: seven of eight fragments fail the depth test.
#[must_use]
pub fn w2f() -> Workload {
    layers("W2f", "8 layers, front to back", &[0, 1, 2, 3, 4, 5, 6, 7])
}

/// Eight layers, the nearest last: every fragment is shaded.
#[must_use]
pub fn w2b() -> Workload {
    layers("W2b", "8 layers, back to front", &[7, 6, 5, 4, 3, 2, 1, 0])
}

/// Small triangles: eight pixels each.
#[must_use]
pub fn w3() -> Workload {
    sphere("W3", "sphere, 262 144 triangles", 512, 256)
}

/// Tiny triangles: half a pixel each.
#[must_use]
pub fn w4() -> Workload {
    sphere("W4", "sphere, 4 194 304 triangles", 2048, 1024)
}

/// W3 without colour.
#[must_use]
pub fn w5() -> Workload {
    Workload { shading: Shading::DepthOnly, ..sphere("W5", "W3, depth only", 512, 256) }
}

/// Any mesh from so near that the near plane cuts it and it reaches over the screen's borders.
///
/// It is brought to the size that the camera expects: the Utah teapot's spout is cut open.
#[must_use]
pub fn w6(mesh: Mesh) -> Workload {
    let low = mesh.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = mesh.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    let fit = Mat4::from_scale(Vec3::splat(4.0 / (high - low).max_element()))
        * Mat4::from_translation((low + high) * -0.5);
    let view = look_at_mat4(Vec3::new(2.1, 0.75, 0.45), Vec3::new(0.0, 0.0, -0.1), Vec3::Y);
    let varyings = mesh.normals.iter().zip(&mesh.uvs).map(|(&normal, &uv)| Lit { normal, uv }).collect();
    Workload {
        name: "W6",
        what: "teapot, close, mip-mapped",
        transform: projection() * view * fit,
        positions: mesh.positions,
        indices: mesh.indices,
        cull_back: false,
        shading: Shading::LitTexture(varyings, Texture::waves()),
    }
}

/// Blending: triangles in order, each over all before it.
///
/// They lie on nested planes (the same w times a falling factor), so that none fails the depth test.
#[must_use]
pub fn w7() -> Workload {
    const COUNT: u32 = 10_000;
    let mut random = Random(7);
    let (mut positions, mut colors) = (Vec::new(), Vec::new());
    for i in 0..COUNT {
        let center = random.in_screen();
        // A triangle of random shape, neither a sliver nor clockwise, scaled to the area.
        let corners = loop {
            let corners = [(); 3].map(|()| Vec2::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0)));
            // Positive when counter-clockwise in NDC, because y points down here.
            let area = 0.5 * (corners[2] - corners[0]).perp_dot(corners[1] - corners[0]);
            if area > 0.15 {
                let scale = (random.between(200.0, 2000.0) / area).sqrt();
                break corners.map(|corner| center + corner * scale);
            }
        };
        let alpha = random.between(0.3, 0.7);
        for corner in corners {
            // 1/w is linear on the screen, so this is a plane.
            let w = (2.0 - i as f32 / COUNT as f32) / (0.7 - 0.3 * corner.x / WIDTH as f32);
            positions.push(unproject(corner, w));
            colors.push((Vec3::new(random.unit(), random.unit(), random.unit()) * alpha).extend(alpha));
        }
    }
    Workload {
        name: "W7",
        what: "10 000 blended triangles",
        transform: projection(),
        positions,
        indices: (0..3 * COUNT).collect(),
        cull_back: true,
        shading: Shading::Blend(colors),
    }
}

/// Guard band: each triangle is 100 000 pixels wide and crosses the screen; every second one is a sliver.
#[must_use]
pub fn w8() -> Workload {
    const COUNT: u32 = 200;
    let mut random = Random(8);
    let (mut positions, mut uvs) = (Vec::new(), Vec::new());
    for i in 0..COUNT {
        let center = random.in_screen();
        let along = Vec2::from_angle(random.between(0.0, core::f32::consts::TAU));
        // Screen coordinates have y down, so this side makes the triangle counter-clockwise in NDC.
        let across = -along.perp();
        let height = if i % 2 == 0 { random.between(1.0, 8.0) } else { random.between(40.0, 900.0) };
        let corners = [
            Vec2::new(-50_000.0, 0.0),
            Vec2::new(50_000.0, 0.0),
            Vec2::new(random.between(-20_000.0, 20_000.0), height),
        ];
        let (cell, phase) = (random.between(24.0, 96.0), random.unit());
        let (w, slope) = (random.between(1.0, 2.0), random.between(-0.5, 0.5));
        for corner in corners {
            let position = center + along * corner.x + across * corner.y;
            // 1/w and uv/w are linear on the screen: a board that lies in the triangle's plane.
            let w = w / (1.0 + slope * corner.x / 50_000.0);
            positions.push(unproject(position, w));
            uvs.push(corner * w / (8.0 * cell) + phase);
        }
    }
    Workload {
        name: "W8",
        what: "200 triangles, 100 000 pixels wide",
        transform: projection(),
        positions,
        indices: (0..3 * COUNT).collect(),
        cull_back: true,
        shading: Shading::Checker(uvs),
    }
}

/// Whole-screen layers in the order given, 0 the nearest, each with its own phase of the checker.
///
/// 1/w is linear over all four corners, so both triangles lie in one plane. The texture coordinates do not:
/// the checker has a kink along the diagonal, which shows where the triangles meet.
fn layers(name: &'static str, what: &'static str, order: &[u8]) -> Workload {
    let size = Vec2::new(WIDTH as f32, HEIGHT as f32);
    let (mut positions, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for (base, &layer) in (0..).step_by(4).zip(order) {
        let layer = f32::from(layer);
        for (uv, w) in [
            (Vec2::new(0.0, 0.0), 10.0),
            (Vec2::new(1.0, 0.0), 1.0 / 0.55),
            (Vec2::new(0.0, 1.0), 1.0 / 0.55),
            (Vec2::new(1.0, 1.0), 1.0),
        ] {
            positions.push(unproject(uv * size, w * (1.0 + layer / 8.0)));
            uvs.push(uv + Vec2::X * (layer / 64.0));
        }
        indices.extend([0, 2, 1, 1, 2, 3].map(|i| base + i));
    }
    Workload {
        name,
        what,
        transform: projection(),
        positions,
        indices,
        cull_back: true,
        shading: Shading::Checker(uvs),
    }
}

/// A slightly tilted sphere of radius 1, counter-clockwise from outside, with the poles on the y axis.
fn sphere(name: &'static str, what: &'static str, columns: u32, rows: u32) -> Workload {
    use core::f32::consts::{PI, TAU};
    let (mut positions, mut varyings, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for row in 0..=rows {
        let (ring, y) = (PI * row as f32 / rows as f32).sin_cos();
        for column in 0..=columns {
            let (sin, cos) = (TAU * column as f32 / columns as f32).sin_cos();
            let normal = Vec3::new(ring * sin, y, ring * cos);
            let uv = Vec2::new(4.0 * column as f32 / columns as f32, 2.0 * row as f32 / rows as f32);
            positions.push(normal);
            varyings.push(Lit { normal, uv });
        }
    }
    let stride = columns + 1;
    for row in 0..rows {
        for column in 0..columns {
            let a = row * stride + column;
            indices.extend([a, a + stride, a + 1, a + 1, a + stride, a + stride + 1]);
        }
    }
    // The silhouette's half angle is asin(1 / distance), and its tangent 0.8 tan 30°.
    let distance = 1.0 / (0.8 * (PI / 6.0).tan()).atan().sin();
    let tilt = Quat::from_rotation_x(0.4) * Quat::from_rotation_z(0.2);
    let model = Mat4::from_rotation_translation(tilt, Vec3::new(0.0, 0.0, -distance));
    Workload {
        name,
        what,
        transform: projection() * model,
        positions,
        indices,
        cull_back: true,
        shading: Shading::LitChecker(varyings),
    }
}

/// The one camera: 60° high, looking along −z.
fn projection() -> Mat4 {
    perspective(core::f32::consts::FRAC_PI_3, WIDTH as f32 / HEIGHT as f32, NEAR, FAR)
}

/// The point that [`projection`] brings to `pixel` (framebuffer coordinates, y down) with this w.
fn unproject(pixel: Vec2, w: f32) -> Vec3 {
    let ndc = pixel / Vec2::new(WIDTH as f32, HEIGHT as f32) * Vec2::new(2.0, -2.0) + Vec2::new(-1.0, 1.0);
    let projection = projection();
    (ndc * w / Vec2::new(projection.x_axis.x, projection.y_axis.y)).extend(-w)
}

// The shading. No `as` from float to integer: it saturates, and costs two to three times the whole loop.
// Instead a float is added to a power of two so large that its lowest mantissa bit is the integer's; the bits
// then hold the integer.

/// 2²³: the bits of `x + ROUND` hold x rounded to the nearest integer, for 0 ≤ x < 2²³.
const ROUND: f32 = 8_388_608.0;
/// 1.5 · 2²³: the same for |x| < 2²², in the lowest 22 bits (two's complement).
const ROUND_SIGNED: f32 = 12_582_912.0;

/// Whether `uv` lies in a light cell of a board with 8×8 cells in the unit square, for |uv| < 32.
///
/// Cells in fixed point, with 14 bits of fraction: bit 14 tells odd ones from even ones, and nothing is rounded down.
#[inline(always)]
fn is_light(uv: Vec2) -> bool {
    const FRACTION: u32 = 14;
    let cells = |x: f32| (x * (8 << FRACTION) as f32 + ROUND_SIGNED).to_bits();
    (cells(uv.x) ^ cells(uv.y)) & 1 << FRACTION == 0
}

/// RGBA8 with red in the lowest byte, from channels that are clamped to \[0, 1\].
#[inline(always)]
#[must_use]
pub fn pack(color: Vec4) -> u32 {
    bytes(color.to_array().map(|channel| channel.clamp(0.0, 1.0) * 255.0))
}

/// Four numbers in \[0, 255\], rounded, the first one in the lowest byte.
///
/// The high bytes of `x + ROUND` are those of `ROUND`. Shifted, they are gone; left are those of the first number.
#[inline(always)]
fn bytes([a, b, c, d]: [f32; 4]) -> u32 {
    let bits = |x: f32| (x + ROUND).to_bits();
    let sum = (bits(b) << 8).wrapping_add(bits(c) << 16).wrapping_add(bits(d) << 24);
    bits(a).wrapping_sub(ROUND.to_bits()).wrapping_add(sum)
}

/// A board of 8×8 cells in the unit square.
#[inline(always)]
#[must_use]
pub fn checker(uv: Vec2) -> u32 {
    if is_light(uv) { 0xFFB8_DCF0 } else { 0xFF7A_4A28 }
}

/// Ambient and diffuse light at a surface with this normal: 0.25 to 1, and perhaps a rounding error.
#[inline(always)]
fn lambert(normal: Vec3) -> f32 {
    let cosine = normal.dot(LIGHT) / normal.dot(normal).sqrt();
    0.25 + 0.75 * if cosine > 0.0 { cosine } else { 0.0 }
}

/// [`checker`] under [`LIGHT`].
#[inline(always)]
#[must_use]
pub fn lit_checker(varyings: Lit) -> u32 {
    const LIGHT_CELL: [f32; 3] = [0.94 * 255.0, 0.86 * 255.0, 0.72 * 255.0];
    const DARK_CELL: [f32; 3] = [0.16 * 255.0, 0.29 * 255.0, 0.48 * 255.0];
    let light = lambert(varyings.normal);
    let [red, green, blue] = if is_light(varyings.uv) { LIGHT_CELL } else { DARK_CELL };
    bytes([red * light, green * light, blue * light, 255.0])
}

/// A mip-mapped texel under [`LIGHT`], in two stages. This is what it is made of: light, and a place in the texture; `dx` and `dy`
/// are the texture coordinates' derivatives along the screen's axes.
#[inline(always)]
#[must_use]
pub fn lit_place(varyings: Lit, dx: Vec2, dy: Vec2) -> (f32, Place) {
    (lambert(varyings.normal), Texture::place(varyings.uv, dx, dy))
}

/// And this the colour.
#[inline(always)]
#[must_use]
pub fn lit_texture(texture: &Texture, (light, place): (f32, Place)) -> u32 {
    let [red, green, blue] = texture.color(place).map(|channel| channel * light);
    bytes([red, green, blue, 255.0])
}

/// The premultiplied colour `over` the pixel `under`: red, green, blue, alpha.
///
/// Four numbers and not a `Vec4`: that is a SIMD register already, which keeps a compiler from putting neighbouring
/// pixels into one.
#[inline(always)]
#[must_use]
pub fn blend(over: [f32; 4], under: u32) -> u32 {
    let rest = 1.0 - over[3];
    // No clamp: a channel is at most alpha, and so the sum at most 1 and a rounding error.
    let channel = |over: f32, shift: u32| {
        let under = ((under >> shift) & 0xFF) as f32;
        ((over * 255.0 + under * rest) + ROUND).to_bits() & 0xFF
    };
    channel(over[0], 0) | channel(over[1], 8) << 8 | channel(over[2], 16) << 16 | channel(over[3], 24) << 24
}

/// Side of the texture's largest level.
const SIDE: usize = 1 << SIDE_LOG2;
const SIDE_LOG2: u32 = 10;

/// A square texture that repeats, RGBA8, with all its mip levels.
///
/// A level of n × n texels begins at index n² and ends before the next larger one, at 4 n². So its start takes no
/// table, and the whole is a power of two: an index that is masked needs no check, and the fetches become SIMD with
/// everything around them.
#[derive(Clone, Debug)]
pub struct Texture {
    texels: Box<[u32; 2 * SIDE * SIDE]>,
}

impl Texture {
    /// Two crossing waves: soft, so that the choice of a level at its limits hardly shows.
    #[must_use]
    pub fn waves() -> Self {
        let wave =
            |i: usize, n: usize| 0.5 + 0.5 * (core::f32::consts::TAU * (i * n) as f32 / SIDE as f32).sin();
        let mut level: Vec<Vec4> = (0..SIDE * SIDE)
            .map(|i| {
                let (x, y) = (i % SIDE, i / SIDE);
                let cells = wave(x, 32) * wave(y, 32) + (1.0 - wave(x, 32)) * (1.0 - wave(y, 32));
                Vec4::new(0.2 + 0.8 * cells, 0.3 + 0.5 * wave(x + y, 2), 0.9 - 0.6 * cells, 1.0)
            })
            .collect();
        let mut texels = vec![0; 2 * SIDE * SIDE];
        let mut side = SIDE;
        while side > 0 {
            for (texel, &color) in texels[side * side..].iter_mut().zip(&level) {
                *texel = pack(color);
            }
            // Halve: the mean of four.
            let (row, half) = (side, side / 2);
            level = (0..half * half)
                .map(|i| 2 * (i / half) * row + 2 * (i % half))
                .map(|i| (level[i] + level[i + 1] + level[i + row] + level[i + row + 1]) * 0.25)
                .collect();
            side = half;
        }
        Self { texels: texels.into_boxed_slice().try_into().expect("as long as it was made") }
    }

    /// Side and texels of each level, the largest first.
    pub fn levels(&self) -> impl Iterator<Item = (usize, &[u32])> {
        let sides = core::iter::successors(Some(SIDE), |side| (*side > 1).then_some(side / 2));
        sides.map(|side| (side, &self.texels[side * side..2 * side * side]))
    }

    /// Red, green and blue, 0 to 255, bilinear in the nearest mip level: OpenGL's `LINEAR_MIPMAP_NEAREST`; for |uv| < 16.
    ///
    /// In two parts: which texels, from the texture coordinates and their derivatives, and their mean. From the derivatives to the
    /// last product each step waits for the one before it; cut in two, both halves are under way for more fragments.
    #[inline(always)]
    #[must_use]
    pub fn place(uv: Vec2, dx: Vec2, dy: Vec2) -> Place {
        const EXPONENT: u32 = 23;
        const ONE: u32 = 1f32.to_bits();
        // round(log₂ ρ) = ⌊log₂(2ρ²) / 2⌋, and the exponent of a float is ⌊log₂⌋. The longer step counts.
        let longer = |a: f32, b: f32| if a > b { a } else { b };
        let rho2 = longer(dx.length_squared(), dy.length_squared()) * (2 * SIDE * SIDE) as f32;
        let rho2 = longer(rho2, 1.0);
        let rho2 = if rho2 < (2 * SIDE * SIDE) as f32 { rho2 } else { (2 * SIDE * SIDE) as f32 };
        let level = (rho2.to_bits() - ONE) >> 1 & 0xFF << EXPONENT;
        // The level's side, times 256 as a float of that exponent, and as an integer.
        let side_256 = f32::from_bits(ONE + ((SIDE_LOG2 + 8) << EXPONENT) - level);
        let side = f32::from_bits(ONE + (SIDE_LOG2 << EXPONENT) - level);
        let side = (side + ROUND).to_bits() & ((2 << SIDE_LOG2) - 1);

        // 24.8 fixed point from the first texel's centre; `mask` repeats the texture.
        let mask = side - 1;
        let texel = uv * side_256 + (ROUND_SIGNED - 128.0);
        let (x, y) = (texel.x.to_bits(), texel.y.to_bits());
        let (x0, y0) = ((x >> 8) & mask, (y >> 8) & mask);
        let (x1, y1) = ((x0 + 1) & mask, (y0 + 1) & mask);
        // A row's product is of numbers that a compiler knows to have 16 bits at most: half as long as another one.
        let row = |y: u32| ((side + y) & ((4 << SIDE_LOG2) - 1)) * side;
        let (top, bottom) = (row(y0), row(y1));
        ([top + x0, top + x1, bottom + x0, bottom + x1], [x, y])
    }

    /// See [`place`](Self::place). Channels are mixed as floats: SSE2 has no product of 32 bits, and those of 16 take no fewer
    /// steps.
    #[inline(always)]
    #[must_use]
    pub fn color(&self, ([a, b, c, d], [x, y]): Place) -> [f32; 3] {
        let texel = |index: u32| self.texels[index as usize & (2 * SIDE * SIDE - 1)];
        let texels = [texel(a), texel(b), texel(c), texel(d)];
        let fraction = |x: u32| (x & 0xFF) as f32 * (1.0 / 256.0);
        let (s, t) = (fraction(x), fraction(y));
        [bilinear(texels, 0, s, t), bilinear(texels, 8, s, t), bilinear(texels, 16, s, t)]
    }
}

/// The mean of four texels' channel. (Not a closure in an array's `map`: neither of the two is sure to be inlined.)
#[inline(always)]
fn bilinear([a, b, c, d]: [u32; 4], shift: u32, s: f32, t: f32) -> f32 {
    let channel = |texel: u32| (texel >> shift & 0xFF) as f32;
    let (top, bottom) = (mix(channel(a), channel(b), s), mix(channel(c), channel(d), s));
    mix(top, bottom, t)
}

/// Where in a [`Texture`] a colour comes from: four texels, from the top left one on, and the column and row of the place
/// between them, in 256ths.
pub type Place = ([u32; 4], [u32; 2]);

/// a + (b − a) t.
#[inline(always)]
fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// `SplitMix64` (Steele, Lea, Flood 2014): the same triangles on every machine.
struct Random(u64);

impl Random {
    /// In \[0, 1).
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 40) as f32 * (1.0 / 16_777_216.0)
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// A point of the screen, in pixels.
    fn in_screen(&mut self) -> Vec2 {
        Vec2::new(self.between(0.0, WIDTH as f32), self.between(0.0, HEIGHT as f32))
    }
}
