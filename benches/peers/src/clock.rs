//! What time a frame takes.

use clap::ValueEnum;

/// Which time is measured.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum Clock {
    /// The time that this thread was running. Others on the machine do not count, except for what they do to
    /// caches and memory. All contestants draw on this thread alone.
    Cpu,
    /// The time that passed.
    Wall,
}

impl Clock {
    /// For the head of a table.
    pub fn what(self) -> &'static str {
        match self {
            Self::Cpu => "milliseconds of CPU time of the drawing thread (CLOCK_THREAD_CPUTIME_ID)",
            Self::Wall => "milliseconds of wall time",
        }
    }

    /// Milliseconds since some moment.
    pub fn now(self) -> f64 {
        use rustix::time::{ClockId, clock_gettime};
        let time = clock_gettime(match self {
            Self::Cpu => ClockId::ThreadCPUTime,
            Self::Wall => ClockId::Monotonic,
        });
        time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
    }
}
