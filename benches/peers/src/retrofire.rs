//! `retrofire-core` 0.4: scanlines in floats, clipped to the view frustum; no derivatives.

use core::iter::zip;

use glam::{Mat4, Vec3, Vec4};
use retrofire_core::geom::{Tri, Vertex, tri, vertex};
use retrofire_core::math::{Color4, ProjVec3, Vary, pt2, vec2, vec3, viewport};
use retrofire_core::render::raster::Scanline;
use retrofire_core::render::{
    Context, Frag, Framebuf, Target, ctx::FaceCull, render, shader, target::Colorbuf,
};
use retrofire_core::util::{Buf2, Dims, pixfmt::Rgba8888};

use crate::contestant::Contestant;
use crate::workloads::{
    CLEAR_COLOR, FAR, HEIGHT, Lit, NEAR, Shading, WIDTH, Workload, blend, checker, lit_checker,
};

// Its vectors, under names that glam has not taken.
type Retro2 = retrofire_core::math::Vec2;
type Retro3 = retrofire_core::math::Vec3;

pub struct Retrofire {
    frame: Framebuf<Colorbuf<Buf2<[u8; 4]>, Rgba8888>, Buf2<f32>>,
    triangles: Vec<Tri<usize>>,
    scene: Scene,
}

/// Position and varyings together, as its vertex shader wants them.
enum Scene {
    DepthOnly(Vec<(Vec3, ())>),
    Checker(Vec<(Vec3, Retro2)>),
    LitChecker(Vec<(Vec3, (Retro3, Retro2))>),
    /// Two pairs of channels, because its colours are interpolated without perspective.
    Blend(Vec<(Vec3, (Retro2, Retro2))>),
}

impl Retrofire {
    pub fn new() -> Self {
        let dims = Dims(WIDTH, HEIGHT);
        Self {
            frame: Framebuf { color_buf: Colorbuf::new(Buf2::new(dims)), depth_buf: Buf2::new(dims) },
            triangles: Vec::new(),
            scene: Scene::DepthOnly(Vec::new()),
        }
    }
}

impl Contestant for Retrofire {
    fn name(&self) -> &str {
        "retrofire 0.4"
    }

    fn supports(&self, workload: &Workload) -> bool {
        !matches!(workload.shading, Shading::LitTexture(..))
    }

    fn prepare(&mut self, workload: &Workload) {
        self.triangles = workload
            .indices
            .chunks_exact(3)
            .map(|triangle| tri(triangle[0] as usize, triangle[1] as usize, triangle[2] as usize))
            .collect();
        let uv = |uv: glam::Vec2| vec2(uv.x, uv.y);
        let positions = workload.positions.iter().copied();
        self.scene = match &workload.shading {
            Shading::DepthOnly => Scene::DepthOnly(positions.map(|position| (position, ())).collect()),
            Shading::Checker(uvs) => Scene::Checker(zip(positions, uvs.iter().copied().map(uv)).collect()),
            Shading::LitChecker(varyings) => {
                let convert = |lit: &Lit| (vec3(lit.normal.x, lit.normal.y, lit.normal.z), uv(lit.uv));
                Scene::LitChecker(zip(positions, varyings.iter().map(convert)).collect())
            }
            Shading::Blend(colors) => {
                let convert = |color: &Vec4| (vec2(color.x, color.y), vec2(color.z, color.w));
                Scene::Blend(zip(positions, colors.iter().map(convert)).collect())
            }
            Shading::LitTexture(..) => unreachable!("not supported"),
        };
    }

    fn clear(&mut self) {
        self.frame.color_buf.buf.fill(CLEAR_COLOR.to_le_bytes());
        // It keeps 1/w instead of depth.
        self.frame.depth_buf.fill(0.0);
    }

    fn draw(&mut self, workload: &Workload) {
        let Self { frame, triangles, scene } = self;
        let context = Context {
            // It judges the facing after our flip of y, so what it calls a front is our back.
            face_cull: workload.cull_back.then_some(FaceCull::Front),
            color_write: !matches!(scene, Scene::DepthOnly(_)),
            ..Context::default()
        };
        let transform = &workload.transform;
        match scene {
            Scene::DepthOnly(vertices) => {
                run(triangles, vertices, transform, |()| 0, frame, &context);
            }
            Scene::Checker(vertices) => {
                let shade = |uv: Retro2| checker(glam::Vec2::from_array(uv.0));
                run(triangles, vertices, transform, shade, frame, &context);
            }
            Scene::LitChecker(vertices) => {
                let shade = |(normal, uv): (Retro3, Retro2)| {
                    lit_checker(Lit { normal: Vec3::from_array(normal.0), uv: glam::Vec2::from_array(uv.0) })
                };
                run(triangles, vertices, transform, shade, frame, &context);
            }
            Scene::Blend(vertices) => {
                let shade = |(red_green, blue_alpha): (Retro2, Retro2)| {
                    let [red, green] = red_green.0;
                    let [blue, alpha] = blue_alpha.0;
                    crate::workloads::pack(Vec4::new(red, green, blue, alpha))
                };
                run(triangles, vertices, transform, shade, &mut Blended(frame), &context);
            }
        }
    }

    fn read_pixels(&mut self) -> Vec<u32> {
        self.frame.color_buf.buf.data().iter().copied().map(u32::from_le_bytes).collect()
    }

    fn read_depth(&mut self) -> Vec<f32> {
        let depth = |rw: &f32| FAR / (FAR - NEAR) * (1.0 - NEAR * rw);
        self.frame.depth_buf.data().iter().map(|rw| depth(rw).min(1.0)).collect()
    }
}

/// One draw call; `shade` returns RGBA8 with red in the lowest byte.
fn run<V: Vary>(
    triangles: &[Tri<usize>],
    vertices: &[(Vec3, V)],
    transform: &Mat4,
    shade: impl Fn(V) -> u32,
    target: &mut impl Target,
    context: &Context,
) {
    let to_screen = viewport(pt2(0, HEIGHT)..pt2(WIDTH, 0));
    let shader = shader::new(
        |(position, varyings): (Vec3, V), ()| -> Vertex<ProjVec3, V> {
            let clip = *transform * position.extend(1.0);
            vertex(ProjVec3::new(clip.to_array()), varyings)
        },
        |frag: Frag<V>, ()| -> Color4 { Color4::new(shade(frag.var).to_le_bytes()) },
    );
    render(triangles, vertices, &shader, (), to_screen, target, context);
}

/// Its own targets do not blend, but a target may be anybody's.
struct Blended<'a>(&'a mut Framebuf<Colorbuf<Buf2<[u8; 4]>, Rgba8888>, Buf2<f32>>);

impl Target for Blended<'_> {
    fn rasterize<V: Vary, U: Copy, Fs: retrofire_core::render::FragmentShader<V, U>>(
        &mut self,
        mut scanline: Scanline<V>,
        shader: &Fs,
        uniform: U,
        context: &Context,
    ) {
        let run = scanline.xs.start..scanline.xs.end.max(scanline.xs.start);
        let y = scanline.y;
        let colors = &mut self.0.color_buf.buf.as_mut_slice2()[y][run.clone()];
        let depths = &mut self.0.depth_buf.as_mut_slice2()[y][run];
        for ((fragment, color), depth) in scanline.fragments().zip(colors).zip(depths) {
            let rw = fragment.pos.z();
            if context.depth_test(rw, *depth)
                && let Some(over) = shader.shade_fragment(fragment, uniform)
            {
                let over = Vec4::from_array(over.0.map(f32::from)) / 255.0;
                *color = blend(over.to_array(), u32::from_le_bytes(*color)).to_le_bytes();
                *depth = rw;
            }
        }
    }
}
