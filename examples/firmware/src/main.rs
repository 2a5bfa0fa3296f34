//! The firmware: a display, the memory, and a loop.
//!
//! ```text
//!   cargo run --release                  # eight frames into the file `display.bin`, under QEMU
//! ```
//!
//! On a board, `Bus` is the driver of its display (`mipidsi`, `st7789`, `gc9a01` …), whose `fill_contiguous` sends the
//! same bytes over SPI, and the loop has no end.
#![no_std]
#![no_main]

use embedded_graphics_core::pixelcolor::{IntoStorage, Rgb565};
use embedded_graphics_core::prelude::{DrawTarget, OriginDimensions, Pixel, Size};
use embedded_graphics_core::primitives::Rectangle;
use semihosting::fs::File;
use semihosting::io::{self, Write};
use semihosting::process;
use spinning::{FRAMES, Renderer, SIZE, window_bytes};

/// The emulated display: what would go over the bus goes to a file.
struct Bus(File);

impl OriginDimensions for Bus {
    fn size(&self) -> Size {
        Size::new(SIZE.into(), SIZE.into())
    }
}

impl DrawTarget for Bus {
    type Color = Rgb565;
    type Error = io::Error;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb565>>>(&mut self, pixels: I) -> io::Result<()> {
        pixels.into_iter().try_for_each(|Pixel(point, color)| {
            self.fill_contiguous(&Rectangle::new(point, Size::new(1, 1)), [color])
        })
    }

    fn fill_contiguous<I: IntoIterator<Item = Rgb565>>(
        &mut self,
        area: &Rectangle,
        colors: I,
    ) -> io::Result<()> {
        // Drivers do the same: a small buffer, so that the bus is handed more than two bytes at a time.
        let (mut buffer, mut len) = ([0; 256], 0);
        let pixels = colors.into_iter().take((area.size.width * area.size.height) as usize);
        let bytes = window_bytes(area).chain(pixels.flat_map(|color| color.into_storage().to_be_bytes()));
        for byte in bytes {
            buffer[len] = byte;
            len += 1;
            if len == buffer.len() {
                self.0.write_all(&buffer)?;
                len = 0;
            }
        }
        self.0.write_all(&buffer[..len])
    }
}

static mut RENDERER: Renderer = Renderer::new();

#[cortex_m_rt::entry]
fn main() -> ! {
    // SAFETY: the only reference, in a function that runs once.
    let renderer = unsafe { &mut *(&raw mut RENDERER) };
    process::exit(i32::from(show(renderer).is_none()))
}

fn show(renderer: &mut Renderer) -> Option<()> {
    let mut display = Bus(File::create(c"display.bin").ok()?);
    renderer.build();
    (0..FRAMES)
        .step_by(usize::from(FRAMES / 8))
        .try_for_each(|frame| renderer.draw(frame, &mut display)?.ok())
}
