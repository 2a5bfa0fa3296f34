//! Which sides of triangles are drawn, which of them is the front, and which vertex is the provoking one: three fields of
//! [`Rasterizer`](crate::Rasterizer), put together to be asked.

use crate::fragment::Identity;
use crate::state::{CullMode, FrontFace, ProvokingVertex};

/// The three. Twice the signed area of a triangle tells which side it shows: negative when it is counter-clockwise as displayed. One
/// of zero shows none, and should not come here.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing {
    pub(crate) cull_mode: CullMode,
    pub(crate) front_face: FrontFace,
    pub(crate) provoking_vertex: ProvokingVertex,
}

impl Facing {
    #[inline(always)]
    fn is_front(self, is_counter_clockwise: bool) -> bool {
        is_counter_clockwise == (self.front_face == FrontFace::CounterClockwise)
    }

    /// Whether a triangle of twice this area is not drawn.
    #[inline(always)]
    pub(crate) fn culls(self, area2: i64) -> bool {
        let is_front = self.is_front(area2 < 0);
        ((self.cull_mode == CullMode::Front) & is_front) | ((self.cull_mode == CullMode::Back) & !is_front)
    }

    /// Who a triangle is, of which this vertex is the last one in Vulkan's order of provoking vertices.
    #[inline(always)]
    pub(crate) fn identity(self, last_provoking: u8, is_counter_clockwise: bool, primitive: u32) -> Identity {
        let provoking = match self.provoking_vertex {
            ProvokingVertex::First => 0,
            ProvokingVertex::Last => last_provoking,
        };
        Identity { provoking, is_front_facing: self.is_front(is_counter_clockwise), primitive }
    }
}
