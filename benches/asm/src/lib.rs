//! Draw calls whose machine code `check` looks at. Every closure takes one square root, of which the library has none: so
//! a packed root is a shading loop that became SIMD. And some that show that there are no masked stores, and no division for
//! who asks for no perspective.

#[cfg(feature = "dispatch")]
#[path = "../../workloads/draw.rs"]
mod draw;
#[cfg(feature = "dispatch")]
#[path = "../../workloads/mod.rs"]
mod workloads;

use halfplane::glam::{Vec2, Vec3, Vec4};
use halfplane::{
    Flat, Fragment, NoPerspective, Primitives, Rasterizer, Surface, Varyings, Viewport, floor_to_i32,
    pack_rgba8, pack_srgba8,
};

/// A user's own varyings.
#[derive(Clone, Copy)]
pub struct Lit {
    pub normal: Vec3,
    pub uv: Vec2,
}

halfplane::varyings!(Lit { normal, uv });

/// A texture of one channel.
pub struct Texture {
    pub texels: Box<[u32; 64 * 64]>,
}

/// What is drawn, and where.
pub struct Scene<'a, V> {
    pub pixels: &'a mut [u32],
    pub depth: &'a mut [f32],
    pub positions: &'a [Vec4],
    pub varyings: &'a [V],
}

#[inline(always)]
fn draw<V: Varyings, R: Into<Option<u32>>>(
    scene: &mut Scene<'_, V>,
    shade: impl FnMut(Fragment<'_, V>, u32) -> R,
) -> bool {
    let Ok(viewport) = Viewport::of_size(640, 480) else { return false };
    let Ok(mut target) = Surface::new(scene.pixels, scene.depth, 640, 480) else { return false };
    let rasterizer = Rasterizer::new(viewport);
    rasterizer.draw_over(&mut target, Primitives::list(), scene.positions, scene.varyings, shade).is_ok()
}

#[inline(always)]
fn length(v: Vec2) -> f32 {
    (v.x * v.x + v.y * v.y).sqrt()
}

#[inline(never)]
pub fn packed_vec2(scene: &mut Scene<'_, Vec2>) -> bool {
    draw(scene, |fragment, _| {
        let uv = fragment.varyings();
        pack_rgba8(Vec4::new(uv.x, uv.y, length(uv), 1.0))
    })
}

/// Compiled for more than everything around it: all of the draw comes along.
#[target_feature(enable = "avx2")]
#[inline(never)]
pub fn dispatched_vec2(scene: &mut Scene<'_, Vec2>) -> bool {
    draw(scene, |fragment, _| {
        let uv = fragment.varyings();
        pack_rgba8(Vec4::new(uv.x, length(uv), uv.y, 1.0))
    })
}

#[inline(never)]
pub fn packed_struct(scene: &mut Scene<'_, Lit>) -> bool {
    draw(scene, |fragment, _| {
        let Lit { normal, uv } = fragment.varyings();
        let light = normal.dot(Vec3::new(0.48, 0.64, 0.6)) / normal.dot(normal).sqrt();
        pack_rgba8(Vec4::new(uv.x * light, uv.y * light, light, 1.0))
    })
}

/// Weights over the vertices are put into the caller's order, and those of a cut triangle are of the whole.
#[inline(never)]
pub fn packed_weights(scene: &mut Scene<'_, Vec2>) -> bool {
    draw(scene, |fragment, _| {
        let ([a, b, _], [p, _, r]) = (fragment.weights(), fragment.barycentrics());
        pack_rgba8(Vec4::new(a, b, (p * p + r * r).sqrt(), 1.0))
    })
}

/// What the closure holds might be the framebuffer, for all that the compiler knows. And the index needs no check.
#[inline(never)]
pub fn packed_texture(scene: &mut Scene<'_, Vec2>, texture: &Texture) -> bool {
    draw(scene, |fragment, _| {
        let uv = fragment.varyings() * 64.0;
        let (x, y) = (floor_to_i32(uv.x), floor_to_i32(uv.y));
        let texel = |x: i32, y: i32| f32::from_bits(texture.texels[(y as usize & 63) << 6 | x as usize & 63]);
        let (s, t) = (uv.x - x as f32, uv.y - y as f32);
        let mix = |y: i32| texel(x, y) + (texel(x + 1, y) - texel(x, y)) * s;
        let gray = mix(y) + (mix(y + 1) - mix(y)) * t;
        pack_rgba8(Vec4::new(gray, gray, length(uv), 1.0))
    })
}

/// In two stages, with a root in one of them.
#[inline(always)]
fn draw_staged<const IN_FIRST: bool>(scene: &mut Scene<'_, Vec2>, texture: &Texture) -> bool {
    let Ok(viewport) = Viewport::of_size(640, 480) else { return false };
    let Ok(mut target) = Surface::new(scene.pixels, scene.depth, 640, 480) else { return false };
    let rasterizer = Rasterizer::<Vec2>::new(viewport);
    let staged = rasterizer.staged(|fragment| {
        let uv = fragment.varyings() * 64.0;
        let scale = if IN_FIRST { length(uv) } else { 1.0 };
        let (x, y) = (floor_to_i32(uv.x), floor_to_i32(uv.y));
        let index = |x: i32, y: i32| (y as u32 & 63) << 6 | x as u32 & 63;
        let texels = [index(x, y), index(x + 1, y), index(x, y + 1), index(x + 1, y + 1)];
        (texels, uv.x - x as f32, uv.y - y as f32, scale)
    });
    // Three channels of ten bits: enough for the compiler to find SIMD worth while.
    let second = |(texels, s, t, scale): ([u32; 4], f32, f32, f32)| {
        let [a, b, c, d] = texels;
        let texel = |at: u32| texture.texels[at as usize & 0xfff];
        let (a, b, c, d) = (texel(a), texel(b), texel(c), texel(d));
        let channel = |shift: u32| {
            let part = |texel: u32| (texel >> shift & 0x3ff) as f32 / 1023.0;
            let (top, bottom) = (part(a) + (part(b) - part(a)) * s, part(c) + (part(d) - part(c)) * s);
            (top + (bottom - top) * t) * scale
        };
        let (red, green, blue) = (channel(0), channel(10), channel(20));
        pack_rgba8(Vec4::new(red, green, if IN_FIRST { blue } else { blue.sqrt() }, 1.0))
    };
    staged.draw(&mut target, Primitives::list(), scene.positions, scene.varyings, second).is_ok()
}

#[inline(never)]
pub fn packed_first(scene: &mut Scene<'_, Vec2>, texture: &Texture) -> bool {
    draw_staged::<true>(scene, texture)
}

#[inline(never)]
pub fn packed_second(scene: &mut Scene<'_, Vec2>, texture: &Texture) -> bool {
    draw_staged::<false>(scene, texture)
}

/// Two textures in one array, of which each triangle names its own.
#[inline(never)]
pub fn packed_materials(scene: &mut Scene<'_, (Vec2, Flat<i32>)>, textures: &Texture) -> bool {
    let Ok(viewport) = Viewport::of_size(640, 480) else { return false };
    let Ok(mut target) = Surface::new(scene.pixels, scene.depth, 640, 480) else { return false };
    let rasterizer = Rasterizer::<(Vec2, Flat<i32>)>::new(viewport);
    let staged = rasterizer.staged(|fragment| {
        let (uv, Flat(material)) = fragment.varyings();
        let (x, y) = (floor_to_i32(uv.x * 64.0), floor_to_i32(uv.y * 32.0));
        (material * (32 * 64) + (y & 31) * 64 + (x & 63), length(uv))
    });
    let second = |(texel, scale): (i32, f32)| {
        let texel = textures.texels[texel as usize & (2 * 32 * 64 - 1)];
        let [red, green, blue] = [0, 10, 20].map(|shift| (texel >> shift & 0x3ff) as f32 / 1023.0 * scale);
        pack_rgba8(Vec4::new(red, green, blue, 1.0))
    };
    staged.draw(&mut target, Primitives::list(), scene.positions, scene.varyings, second).is_ok()
}

/// Two draws of one [`halfplane::Staged`]: the attribute brings its closure into both.
#[inline(never)]
pub fn packed_staged_twice(scene: &mut Scene<'_, Lit>) -> bool {
    let Ok(viewport) = Viewport::of_size(640, 480) else { return false };
    let Ok(mut target) = Surface::new(scene.pixels, scene.depth, 640, 480) else { return false };
    let rasterizer = Rasterizer::<Lit>::new(viewport);
    let staged = rasterizer.staged(
        #[inline(always)]
        |fragment| large(fragment),
    );
    staged.draw(&mut target, Primitives::list(), scene.positions, scene.varyings, |color: u32| color).is_ok()
        & staged
            .draw_over(
                &mut target,
                Primitives::list(),
                scene.positions,
                scene.varyings,
                |color: u32, below| color ^ below,
            )
            .is_ok()
}

/// Selecting between results takes more instructions in SSE2, and the compiler leaves the loop as it is.
#[inline(never)]
pub fn avx2_discard(scene: &mut Scene<'_, Vec2>) -> bool {
    draw(scene, |fragment, _| {
        let radius = length(fragment.varyings());
        (radius < 1.0).then_some(pack_rgba8(Vec4::new(radius, radius, radius, 1.0)))
    })
}

/// Numbers that a closure holds by `move` are no references.
#[inline(never)]
pub fn packed_uniform(scene: &mut Scene<'_, Vec2>, tint: Vec3) -> bool {
    draw(scene, move |fragment, _| {
        let uv = fragment.varyings();
        pack_rgba8((tint * length(uv)).extend(uv.x))
    })
}

#[inline(never)]
pub fn packed_blend(scene: &mut Scene<'_, [f32; 4]>) -> bool {
    draw(scene, |fragment, below| {
        let [r, g, b, a] = fragment.varyings();
        let rest = 1.0 - (a * a).sqrt();
        let mix = |over: f32, shift: u32| over + (below >> shift & 0xff) as f32 * (rest / 255.0);
        pack_rgba8(Vec4::new(mix(r, 0), mix(g, 8), mix(b, 16), mix(a, 24)))
    })
}

/// Some light, and what takes many instructions.
#[inline(always)]
fn large(fragment: Fragment<'_, Lit>) -> u32 {
    let Lit { normal, uv } = fragment.varyings();
    let mut sum = 1.0 / normal.dot(normal).sqrt();
    for i in 0..12 {
        let x = uv.x * (1.0 + i as f32) + uv.y;
        sum = sum * 0.5 + (x - floor_to_i32(x) as f32) * normal.z;
    }
    pack_rgba8(Vec4::new(uv.x * sum, uv.y * sum, sum, 1.0))
}

/// A closure in two draws.
#[inline(always)]
fn twice(scene: &mut Scene<'_, Lit>, shade: impl Copy + Fn(Fragment<'_, Lit>, u32) -> u32) -> bool {
    draw(scene, shade) & draw(scene, shade)
}

/// The attribute, which Rust allows before a closure that is an argument, brings it into both.
#[inline(never)]
pub fn packed_twice(scene: &mut Scene<'_, Lit>) -> bool {
    twice(
        scene,
        #[inline(always)]
        |fragment, _| large(fragment),
    )
}

/// Without it, the closure becomes a function of its own, for one fragment.
#[inline(never)]
pub fn scalar_twice(scene: &mut Scene<'_, Lit>) -> bool {
    twice(scene, |fragment, _| large(fragment))
}

/// What shows that the check can fail: a branch that cannot become a selection.
#[inline(never)]
pub fn scalar_branch(scene: &mut Scene<'_, Vec2>) -> bool {
    let mut far = 0;
    draw(scene, |fragment, _| {
        let uv = fragment.varyings();
        if uv.x > 0.5 {
            far += 1;
            core::hint::black_box(&mut far);
        }
        pack_rgba8(Vec4::new(uv.x, uv.y, length(uv), 1.0))
    })
}

/// And `as`, which saturates: each lane is taken out, converted, compared and put back.
#[inline(never)]
pub fn scalar_as(scene: &mut Scene<'_, Vec2>) -> bool {
    draw(scene, |fragment, _| {
        let uv = fragment.varyings();
        let byte = |x: f32| (x * 255.0) as u32;
        byte(uv.x) | byte(uv.y) << 8 | byte(length(uv)) << 16
    })
}

/// Depth alone.
#[inline(never)]
pub fn unmasked_depth(scene: &mut Scene<'_, ()>) -> bool {
    let Ok(viewport) = Viewport::of_size(640, 480) else { return false };
    let Ok(mut target) = Surface::depth_only(scene.depth, 640, 480) else { return false };
    Rasterizer::<()>::new(viewport).draw_depth(&mut target, Primitives::list(), scene.positions).is_ok()
}

/// What compilers make a masked store of.
#[inline(never)]
pub fn masked_choice(old: &mut [f32; 8], new: &[f32; 8]) {
    let mut all = *old;
    for i in 0..8 {
        all[i] = if new[i] < old[i] { new[i] } else { all[i] };
    }
    *old = all;
}

/// Values that are linear on the screen need no division by 1/w.
#[inline(never)]
pub fn spared_naive(scene: &mut Scene<'_, NoPerspective<Vec2>>) -> bool {
    draw(scene, |fragment, _| {
        let uv = fragment.varyings().0;
        pack_rgba8(Vec4::new(uv.x, uv.y, length(uv), 1.0))
    })
}

/// Nor does who asks for depth, 1/w and the place alone, of triangles with values that nobody looks at.
#[inline(never)]
pub fn spared_depth(scene: &mut Scene<'_, Vec2>) -> bool {
    draw(scene, |fragment, _| {
        let depth = fragment.depth();
        pack_rgba8(Vec4::new(depth, depth.sqrt(), fragment.inv_w(), fragment.x() as f32))
    })
}

/// What shows that these can fail: perspective-correct values.
#[inline(never)]
pub fn divided_vec2(scene: &mut Scene<'_, Vec2>) -> bool {
    draw(scene, |fragment, _| {
        let uv = fragment.varyings();
        pack_rgba8(Vec4::new(uv.x, uv.y, length(uv), 0.5))
    })
}

/// Packing to sRGB, by powers and not by a table.
#[inline(never)]
pub fn packed_srgb(scene: &mut Scene<'_, Vec2>) -> bool {
    draw(scene, |fragment, _| {
        let uv = fragment.varyings();
        pack_srgba8(Vec4::new(uv.x, uv.y, length(uv), 1.0))
    })
}

/// The scenes of the benches, dispatched as `benches/peers` does it: each closure, theirs and the library's, is used in two
/// functions, and LLVM need not bring it into both unless it is told to. One that is called is not compiled for AVX2.
#[cfg(feature = "dispatch")]
#[target_feature(enable = "avx2")]
#[inline(never)]
pub fn inlined_workload(canvas: &mut draw::Canvas, workload: &workloads::Workload) -> u64 {
    canvas.draw(workload, 0..workloads::HEIGHT).samples_passed
}

/// And this the other function.
#[cfg(feature = "dispatch")]
#[inline(never)]
pub fn other_workload(canvas: &mut draw::Canvas, workload: &workloads::Workload) -> u64 {
    canvas.draw(workload, 0..workloads::HEIGHT).samples_passed
}
