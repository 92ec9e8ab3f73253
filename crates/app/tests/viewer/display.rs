//! A screen for tests: Xvfb on a free number, or a visible skip.

use crate::common::{Need, skip};
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

/// A running X server without a screen; it ends when dropped.
pub struct Display {
    server: Child,
    number: String,
}

impl Display {
    /// Starts one; `None` after a [`skip`] where Xvfb is missing.
    pub fn open() -> Option<Self> {
        let command = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1280x800x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut server = match command {
            Ok(server) => server,
            Err(e) => {
                skip(Need::Screen, format_args!("Xvfb does not start ({e}); on Debian: apt-get install xvfb"));
                return None;
            }
        };
        let mut number = String::new();
        let told = server.stdout.take().map(|out| BufReader::new(out).read_line(&mut number));
        assert!(matches!(told, Some(Ok(n)) if n > 0), "Xvfb ended without telling its number");
        Some(Self { server, number: number.trim().into() })
    }

    /// What DISPLAY is set to.
    pub fn name(&self) -> String {
        format!(":{}", self.number)
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
