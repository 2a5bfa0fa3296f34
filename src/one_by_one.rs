//! The fragment half of a draw where there is no SIMD: row by row, one fragment after the other.
//!
//! Less memory and less code than packets, and the same results.

use crate::depth::{DepthFormat, DepthTest};
use crate::fragment::{Fragment, Shading};
use crate::interpolate::Varyings;
use crate::setup::Setup;
use crate::shade::DepthPlane;
use crate::state::Statistics;
use crate::target::{Framebuffer, Rect};

/// What it works with.
#[derive(Debug)]
pub(crate) struct OneByOne<'a, F, T, S> {
    pub(crate) target: &'a mut F,
    /// The pixels that may be drawn to.
    pub(crate) render_area: Rect,
    pub(crate) test: T,
    pub(crate) shade: S,
}

impl<F: Framebuffer, T: DepthTest, S> OneByOne<'_, F, T, S> {
    /// Draws a triangle.
    #[inline(always)]
    pub(crate) fn draw<V, R>(
        &mut self,
        setup: &Setup,
        shading: &Shading<'_, V>,
        plane: &DepthPlane,
        statistics: &mut Statistics,
    ) where
        V: Varyings,
        S: FnMut(Fragment<'_, V>, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        let step = shading.step_x();
        setup.for_each_span(self.render_area, |span| {
            let (mut x, y) = (span.start(), span.y());
            let (edges, len) = (span.edges(), (span.end() - x) as usize);
            let (base, z) = (shading.sample(edges), plane.at_edges(edges[0], edges[1]));
            let run = self.target.run(x, y, len);
            let (mut shaded, mut kept) = (0u32, 0u32);
            for (color, depth) in run.color.iter_mut().zip(run.depth).take(len) {
                let dx = x.wrapping_sub(span.anchor()) as f32;
                let z = plane.moved(z, dx);
                let new = F::Depth::from_depth(z);
                if !F::Depth::IS_STORED || self.test.passes(new, *depth) {
                    let at = base.moved(step, dx);
                    let fragment = Fragment { triangle: shading, at, x, y, depth: z };
                    shaded += 1;
                    if let Some(result) = (self.shade)(fragment, *color).into() {
                        kept += 1;
                        *color = result;
                        if self.test.writes() {
                            *depth = new;
                        }
                    }
                }
                x = x.wrapping_add(1);
            }
            statistics.fragments += u64::from(shaded);
            statistics.samples_passed += u64::from(kept);
        });
    }
}
