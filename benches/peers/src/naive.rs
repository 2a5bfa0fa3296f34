//! The loop of every tutorial: for each pixel of the bounding box, three edge functions in floats.
//!
//! No fill rule, no clipping, no snapping: what a weekend's own rasterizer does, and the floor for everybody
//! else.

use glam::{Vec2, Vec3, Vec4};

use crate::contestant::Contestant;
use crate::frame::Frame;
use crate::workloads::{HEIGHT, Lit, Shading, WIDTH, Workload, blend, checker, lit_checker};

pub struct Naive {
    frame: Frame,
    /// Screen x, screen y, depth, 1/w.
    projected: Vec<Vec4>,
}

impl Naive {
    pub fn new() -> Self {
        Self { frame: Frame::new(), projected: Vec::new() }
    }

    /// Calls `pixel(corners, weights, index)` for each pixel that passes the depth test.
    fn fill(&mut self, workload: &Workload, mut pixel: impl FnMut(&mut u32, [usize; 3], Vec3)) {
        let (width, height) = (WIDTH as f32, HEIGHT as f32);
        self.projected.clear();
        self.projected.extend(workload.positions.iter().map(|position| {
            let clip = workload.transform * position.extend(1.0);
            let rw = 1.0 / clip.w;
            let (x, y) = ((clip.x * rw + 1.0) * 0.5 * width, (1.0 - clip.y * rw) * 0.5 * height);
            Vec4::new(x, y, clip.z * rw, rw)
        }));
        for triangle in workload.indices.chunks_exact(3) {
            let corners = [triangle[0] as usize, triangle[1] as usize, triangle[2] as usize];
            let [a, b, c] = corners.map(|corner| self.projected[corner]);
            let edge = |p: Vec4, q: Vec4, s: Vec2| (q.y - p.y) * (s.x - p.x) - (q.x - p.x) * (s.y - p.y);
            let area = edge(a, b, Vec2::new(c.x, c.y));
            if area <= 0.0 && workload.cull_back || area == 0.0 {
                continue;
            }
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            let clamp = |x: f32, size: u32| x.max(0.0).min(size as f32) as usize;
            for y in clamp(low.y, HEIGHT)..clamp(high.y.ceil(), HEIGHT) {
                for x in clamp(low.x, WIDTH)..clamp(high.x.ceil(), WIDTH) {
                    let sample = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                    let linear = Vec3::new(edge(b, c, sample), edge(c, a, sample), edge(a, b, sample)) / area;
                    if linear.min_element() < 0.0 {
                        continue;
                    }
                    let depth = linear.dot(Vec3::new(a.z, b.z, c.z));
                    let index = y * WIDTH as usize + x;
                    if depth < self.frame.depth[index] {
                        self.frame.depth[index] = depth;
                        let weights = linear * Vec3::new(a.w, b.w, c.w);
                        let weights = weights / (weights.x + weights.y + weights.z);
                        pixel(&mut self.frame.color[index], corners, weights);
                    }
                }
            }
        }
    }
}

impl Contestant for Naive {
    fn name(&self) -> &str {
        "naive loop"
    }

    fn supports(&self, workload: &Workload) -> bool {
        !matches!(workload.shading, Shading::LitTexture(..))
    }

    fn prepare(&mut self, _: &Workload) {}

    fn clear(&mut self) {
        self.frame.clear();
    }

    fn draw(&mut self, workload: &Workload) {
        match &workload.shading {
            Shading::DepthOnly => self.fill(workload, |_, _, _| {}),
            Shading::Checker(uvs) => self.fill(workload, |pixel, corners, weights| {
                let [a, b, c] = corners.map(|corner| uvs[corner]);
                *pixel = checker(a * weights.x + b * weights.y + c * weights.z);
            }),
            Shading::LitChecker(varyings) => self.fill(workload, |pixel, corners, weights| {
                let [a, b, c] = corners.map(|corner| varyings[corner]);
                *pixel = lit_checker(Lit {
                    normal: a.normal * weights.x + b.normal * weights.y + c.normal * weights.z,
                    uv: a.uv * weights.x + b.uv * weights.y + c.uv * weights.z,
                });
            }),
            Shading::Blend(colors) => self.fill(workload, |pixel, corners, weights| {
                let [a, b, c] = corners.map(|corner| colors[corner]);
                let over = a * weights.x + b * weights.y + c * weights.z;
                *pixel = blend(over.to_array(), *pixel);
            }),
            Shading::LitTexture(..) => unreachable!("no near clipping, no derivatives"),
        }
    }

    fn read_pixels(&mut self) -> Vec<u32> {
        self.frame.color.clone()
    }

    fn read_depth(&mut self) -> Vec<f32> {
        self.frame.depth.clone()
    }
}
