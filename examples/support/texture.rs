//! A mip-mapped texture, made here, and three ways to sample it.
//!
//! Texels are linear light; coordinates have u right and v down, and repeat at every integer. Level 0 is the
//! largest, each further one half as large, the last a single texel. All sizes are powers of two, so that
//! wrapping is a mask.

use super::image::srgb_to_linear;
use halfplane::{
    floor_to_i32,
    glam::{Vec2, Vec3},
};

/// A square texture with all its levels.
#[derive(Clone, Debug)]
pub struct Texture {
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    size: u32,
    texels: Vec<Vec3>,
}

impl Texture {
    /// Builds all levels below `size` × `size` texels of linear light, each texel the mean of four.
    ///
    /// # Panics
    ///
    /// If `size` is not a power of two, or there are not that many texels.
    pub fn new(size: u32, texels: Vec<Vec3>) -> Self {
        assert!(size.is_power_of_two(), "a texture of {size}x{size} texels cannot wrap by a mask");
        assert_eq!(texels.len(), size as usize * size as usize, "a texture of {size}x{size}");
        let mut levels = vec![Level { size, texels }];
        while let Some(level) = levels.last().filter(|level| level.size > 1) {
            let half = level.size / 2;
            let mean = |i: u32| {
                let (x, y) = ((i % half * 2) as i32, (i / half * 2) as i32);
                let pairs = level.texel(x, y)
                    + level.texel(x + 1, y)
                    + (level.texel(x, y + 1) + level.texel(x + 1, y + 1));
                pairs * 0.25
            };
            let texels = (0..half * half).map(mean).collect();
            levels.push(Level { size: half, texels });
        }
        Self { levels }
    }

    /// A board of 8 × 8 numbered squares, with lines, dots and letters too fine to be seen from afar.
    pub fn test_pattern() -> Self {
        const SIZE: u32 = 512;
        let texels = (0..SIZE * SIZE).map(|i| srgb_to_linear(pattern(i % SIZE, i / SIZE)));
        Self::new(SIZE, texels.collect())
    }

    /// Texels along one side of the largest level.
    pub fn size(&self) -> u32 {
        self.levels[0].size
    }

    /// The level of detail at which one texel is as large as a pixel, from the change of the coordinates to
    /// the next pixel: log₂ of the longer of the two, in texels (Vulkan, "Scale Factor Operation, LOD
    /// Operation"), within 0.05.
    pub fn level_of_detail(&self, d_dx: Vec2, d_dy: Vec2) -> f32 {
        let (x, y) = (d_dx.length_squared(), d_dy.length_squared());
        let (longer, size) = (if x > y { x } else { y }, self.size() as f32);
        let squared = longer * (size * size);
        // A float's bits, read as a number, are 2²³ (127 + log₂), with straight lines between the powers of
        // two. The half undoes the square.
        let log2 = squared.to_bits() as i32 as f32 * (1.0 / 8_388_608.0) - 126.957;
        0.5 * log2
    }

    /// The nearest texel of level 0: sharp near by, and noise from afar.
    pub fn nearest(&self, uv: Vec2) -> Vec3 {
        let level = &self.levels[0];
        let uv = uv * level.size as f32;
        level.texel(floor_to_i32(uv.x), floor_to_i32(uv.y))
    }

    /// Between the four nearest texels of level 0: smooth near by, and still noise from afar.
    pub fn bilinear(&self, uv: Vec2) -> Vec3 {
        self.levels[0].bilinear(uv)
    }

    /// Between the two levels around `lod`, [`level_of_detail`](Self::level_of_detail)'s result: smooth at
    /// any distance.
    pub fn trilinear(&self, uv: Vec2, lod: f32) -> Vec3 {
        // NaN fails both comparisons and takes level 0.
        let last = (self.levels.len() - 1) as f32;
        let lod = if lod > 0.0 { lod } else { 0.0 };
        let lod = if lod < last { lod } else { last };
        let level = floor_to_i32(lod);
        // Below the last level there is none, and a fraction of 0.
        let [fine, coarse] =
            [level, level + 1].map(|i| &self.levels[(i as usize).min(self.levels.len() - 1)]);
        fine.bilinear(uv).lerp(coarse.bilinear(uv), lod - level as f32)
    }
}

impl Level {
    /// The texel at any column and row: the texture repeats.
    fn texel(&self, x: i32, y: i32) -> Vec3 {
        let wrap = |i: i32| i as u32 & (self.size - 1);
        self.texels[(wrap(y) * self.size + wrap(x)) as usize]
    }

    fn bilinear(&self, uv: Vec2) -> Vec3 {
        // Texel centres lie on halves, as pixel centres do.
        let uv = uv * self.size as f32 - 0.5;
        let (x, y) = (floor_to_i32(uv.x), floor_to_i32(uv.y));
        let (right, down) = (uv.x - x as f32, uv.y - y as f32);
        let row = |y| self.texel(x, y).lerp(self.texel(x.wrapping_add(1), y), right);
        row(y).lerp(row(y.wrapping_add(1)), down)
    }
}

/// The pattern's sRGB colour at a texel of 512 × 512.
fn pattern(x: u32, y: u32) -> Vec3 {
    let (column, row) = (x / 64, y / 64);
    let (x, y) = (x % 64, y % 64);
    let is_dark = (column + row) % 2 == 1;
    // Hue goes with the column, lightness with the row.
    let hue = column as f32 / 8.0;
    let tint = [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|offset| {
        let wave = ((hue + offset) % 1.0 * 2.0 - 1.0).abs(); // 1 at 0, 0 at a half
        wave * wave * (3.0 - 2.0 * wave)
    });
    let paint = Vec3::from_array(tint) * 0.45 + 0.25 + row as f32 * 0.02;
    let paper = Vec3::new(0.93, 0.91, 0.86);
    let (ground, ink) = if is_dark { (paint, paper) } else { (paper, paint) };

    let is_frame = x == 0 || y == 0 || x == 63 || y == 63;
    let is_fine_line = (y / 2) % 2 == 0 && (6..58).contains(&x) && (48..58).contains(&y);
    let is_dot = x % 8 == 4 && y % 8 == 4 && y < 48;
    let is_letter = letter(row as usize, x, y, 10) || letter(8 + column as usize, x, y, 34);
    if is_frame || is_fine_line || is_letter {
        ink
    } else if is_dot {
        ground.lerp(ink, 0.5)
    } else {
        ground
    }
}

/// Whether a texel of a square is set in the glyph whose left edge is at `left`: A to H, 1 to 8.
fn letter(glyph: usize, x: u32, y: u32, left: u32) -> bool {
    /// Three dots wide and five high, from the top left one in bit 14 on; a dot is 6 × 7 texels.
    const GLYPHS: [u16; 16] = [
        0b010_101_111_101_101,
        0b110_101_110_101_110,
        0b011_100_100_100_011,
        0b110_101_101_101_110,
        0b111_100_110_100_111,
        0b111_100_110_100_100,
        0b011_100_101_101_011,
        0b101_101_111_101_101,
        0b010_110_010_010_111,
        0b110_001_010_100_111,
        0b110_001_010_001_110,
        0b101_101_111_001_001,
        0b111_100_110_001_110,
        0b011_100_111_101_111,
        0b111_001_010_010_010,
        0b111_101_111_101_111,
    ];
    let (x, y) = (x.wrapping_sub(left) / 6, y.wrapping_sub(8) / 7);
    x < 3 && y < 5 && GLYPHS[glyph] >> (14 - 3 * y - x) & 1 == 1
}
