//! What a command takes, by the clock and of processors: machines differ by a factor of two, and
//! other work runs beside it.

use std::fmt;
use std::time::Instant;

/// Ticks of a processor in a second, as Linux counts them for programs (`USER_HZ`).
const TICKS: f64 = 100.0;

/// A moment, with what the programs that this one has started have taken until then.
pub struct Spent {
    clock: Instant,
    /// Seconds of processors, user and system; `None` where the system does not say.
    processors: Option<f64>,
}

impl Spent {
    /// Now.
    pub fn now() -> Self {
        let text = std::fs::read_to_string("/proc/self/stat").ok();
        Self { clock: Instant::now(), processors: text.as_deref().and_then(of_children) }
    }

    /// What has been spent from `before` to this moment.
    pub fn since(&self, before: &Spent) -> Between {
        let processors = self.processors.zip(before.processors).map(|(now, then)| now - then);
        Between { clock: (self.clock - before.clock).as_secs_f64(), processors }
    }
}

/// Between two moments, seconds.
pub struct Between {
    clock: f64,
    processors: Option<f64>,
}

impl fmt::Display for Between {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.1} min", self.clock / 60.0)?;
        match self.processors {
            Some(seconds) => write!(f, ", {:.1} min of processors", seconds / 60.0),
            None => Ok(()),
        }
    }
}

/// Seconds that ended children and theirs took: fields 16 and 17 of Linux' `/proc/PID/stat`. The
/// second field is the program's name in brackets, which may hold anything.
fn of_children(stat: &str) -> Option<f64> {
    let (_, rest) = stat.rsplit_once(')')?;
    let mut ticks = rest.split_whitespace().skip(13).map(|w| w.parse::<f64>().ok());
    Some((ticks.next()?? + ticks.next()??) / TICKS)
}

#[cfg(test)]
mod checks {
    use super::*;

    #[test]
    fn children_are_counted_whatever_the_program_is_called() {
        let line = "7 (a) (b 1) S 1 2 3 4 5 6 7 8 9 10 11 12 250 150 20 0 1";
        assert_eq!(of_children(line), Some(4.0));
        assert_eq!(of_children("7 (a) S 1 2"), None);
    }

    #[test]
    fn work_of_children_is_seen() {
        let before = Spent::now();
        let mut shell = std::process::Command::new("sh");
        shell.args(["-c", "i=0; while [ $i -lt 200000 ]; do i=$((i+1)); done"]);
        if shell.status().is_ok() && before.processors.is_some() {
            let spent = Spent::now().since(&before);
            assert!(spent.processors.is_some_and(|s| s > 0.0 && s < spent.clock + 0.1), "{spent}");
        }
    }
}
