//! Three of anything.

/// `array::map` for three, without the loop that it sometimes stays: this is called a million times a frame.
#[inline(always)]
pub(crate) fn each<T, U>([a, b, c]: [T; 3], mut f: impl FnMut(T) -> U) -> [U; 3] {
    [f(a), f(b), f(c)]
}
