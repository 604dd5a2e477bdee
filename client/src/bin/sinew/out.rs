//! What goes to standard output. `println!` panics where the reader has left, as in `sinew inspect … | head`; here that is
//! an error like any other, and [`reader_left`] knows it.

use std::{
    fmt::Arguments,
    io::{self, Write as _},
};

/// Writes to standard output and leaves the function with the error where that fails.
macro_rules! put {
    ($($text:tt)*) => { $crate::out::write(format_args!($($text)*))? };
}

/// [`put!`], and a line's end.
macro_rules! say {
    ($($text:tt)*) => { $crate::out::put!("{}\n", format_args!($($text)*)) };
}

pub(crate) use {put, say};

pub(crate) fn write(text: Arguments<'_>) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_fmt(text)?;
    out.flush()
}

/// Whether a command ended only because nobody reads its output any more.
pub(crate) fn reader_left(failure: &(dyn std::error::Error + 'static)) -> bool {
    let error = failure.downcast_ref::<io::Error>();
    error.is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
}
