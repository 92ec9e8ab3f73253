//! Results on standard output. Whoever reads them may stop reading (`| head -1`), which is no
//! error; a full disk is one.

use std::io::{ErrorKind, Write};

/// As `println!`, which panics where nobody reads or nothing can be written.
macro_rules! say {
    ($($words:tt)*) => { $crate::cli::stdout::line(format_args!($($words)*)) };
}
pub(super) use say;

/// Writes a line. Ends the program where that cannot be done: with success where the reader has
/// gone, else with the code for what goes wrong while running.
pub(super) fn line(words: std::fmt::Arguments<'_>) {
    let mut out = std::io::stdout().lock();
    let Err(error) = writeln!(out, "{words}").and_then(|()| out.flush()) else { return };
    if error.kind() == ErrorKind::BrokenPipe {
        std::process::exit(0);
    }
    eprintln!("error: cannot write to standard output: {error}");
    std::process::exit(super::error::RUNTIME.into());
}
