//! `euc` 0.5.3: barycentrics per pixel of the bounding box; no near clipping, no blending, no derivatives.

use ::euc::rasterizer::{BackfaceCullingDisabled, BackfaceCullingEnabled, BackfaceMode, Triangles};
use ::euc::{Interpolate, Pipeline, Target, buffer::Buffer2d};
use glam::{Mat4, Vec2, Vec3};

use crate::contestant::Contestant;
use crate::workloads::{
    CLEAR_COLOR, CLEAR_DEPTH, HEIGHT, Lit, Shading, WIDTH, Workload, checker, lit_checker,
};

pub struct Euc {
    color: Buffer2d<u32>,
    depth: Buffer2d<f32>,
    /// A depth-only pass still needs a target of the same size: one of nothing.
    nothing: Buffer2d<()>,
}

impl Euc {
    pub fn new() -> Self {
        let size = [WIDTH as usize, HEIGHT as usize];
        Self {
            color: Buffer2d::new(size, CLEAR_COLOR),
            depth: Buffer2d::new(size, CLEAR_DEPTH),
            nothing: Buffer2d::new(size, ()),
        }
    }

    fn run<B: BackfaceMode>(&mut self, workload: &Workload) {
        let Workload { transform, positions, indices, .. } = workload;
        match &workload.shading {
            Shading::DepthOnly => DepthPass { transform: *transform, positions }.draw::<Triangles<_, B>, _>(
                indices,
                &mut self.nothing,
                Some(&mut self.depth),
            ),
            Shading::Checker(varyings) => {
                let shade = |varyings: &Plain<Vec2>| checker(varyings.0);
                Pass { transform: *transform, positions, varyings, shade }.draw::<Triangles<_, B>, _>(
                    indices,
                    &mut self.color,
                    Some(&mut self.depth),
                );
            }
            Shading::LitChecker(varyings) => {
                let shade = |varyings: &Plain<Lit>| lit_checker(varyings.0);
                Pass { transform: *transform, positions, varyings, shade }.draw::<Triangles<_, B>, _>(
                    indices,
                    &mut self.color,
                    Some(&mut self.depth),
                );
            }
            Shading::LitTexture(..) | Shading::Blend(_) => unreachable!("not supported"),
        }
    }
}

impl Contestant for Euc {
    fn name(&self) -> &str {
        "euc 0.5.3"
    }

    fn supports(&self, workload: &Workload) -> bool {
        !matches!(workload.shading, Shading::LitTexture(..) | Shading::Blend(_))
    }

    fn prepare(&mut self, _: &Workload) {}

    fn clear(&mut self) {
        self.color.clear(CLEAR_COLOR);
        self.depth.clear(CLEAR_DEPTH);
    }

    fn draw(&mut self, workload: &Workload) {
        if workload.cull_back {
            self.run::<BackfaceCullingEnabled>(workload);
        } else {
            self.run::<BackfaceCullingDisabled>(workload);
        }
    }

    fn read_pixels(&mut self) -> Vec<u32> {
        self.color.as_ref().to_vec()
    }

    fn read_depth(&mut self) -> Vec<f32> {
        self.depth.as_ref().to_vec()
    }
}

/// A pipeline over indices: euc runs the vertex shader once for each index.
struct Pass<'a, V, F> {
    transform: Mat4,
    positions: &'a [Vec3],
    varyings: &'a [V],
    shade: F,
}

impl<V: Copy, F: Fn(&Plain<V>) -> u32> Pipeline for Pass<'_, V, F>
where
    Plain<V>: Interpolate,
{
    type Vertex = u32;
    type VsOut = Plain<V>;
    type Pixel = u32;

    fn vert(&self, &index: &u32) -> ([f32; 4], Plain<V>) {
        let position = self.transform * self.positions[index as usize].extend(1.0);
        (position.to_array(), Plain(self.varyings[index as usize]))
    }

    fn frag(&self, varyings: &Plain<V>) -> u32 {
        (self.shade)(varyings)
    }
}

struct DepthPass<'a> {
    transform: Mat4,
    positions: &'a [Vec3],
}

impl Pipeline for DepthPass<'_> {
    type Vertex = u32;
    type VsOut = ();
    type Pixel = ();

    fn vert(&self, &index: &u32) -> ([f32; 4], ()) {
        ((self.transform * self.positions[index as usize].extend(1.0)).to_array(), ())
    }

    fn frag(&self, (): &()) {}
}

/// Interpolated with `×` and `+`: euc's own implementations use `mul_add`, which is a library call without
/// FMA.
#[derive(Clone, Copy)]
struct Plain<V>(V);

impl Interpolate for Plain<Vec2> {
    #[inline(always)]
    fn lerp2(a: Self, b: Self, x: f32, y: f32) -> Self {
        Self(a.0 * x + b.0 * y)
    }

    #[inline(always)]
    fn lerp3(a: Self, b: Self, c: Self, x: f32, y: f32, z: f32) -> Self {
        Self(a.0 * x + b.0 * y + c.0 * z)
    }
}

impl Interpolate for Plain<Lit> {
    #[inline(always)]
    fn lerp2(a: Self, b: Self, x: f32, y: f32) -> Self {
        Self(Lit { normal: a.0.normal * x + b.0.normal * y, uv: a.0.uv * x + b.0.uv * y })
    }

    #[inline(always)]
    fn lerp3(a: Self, b: Self, c: Self, x: f32, y: f32, z: f32) -> Self {
        Self(Lit {
            normal: a.0.normal * x + b.0.normal * y + c.0.normal * z,
            uv: a.0.uv * x + b.0.uv * y + c.0.uv * z,
        })
    }
}
