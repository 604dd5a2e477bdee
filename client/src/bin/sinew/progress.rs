//! How far a run is: a bar on a terminal, a line now and then elsewhere.

use std::{
    io::{IsTerminal as _, stderr},
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressStyle};

/// Lines, where there is no terminal, come this often.
const LINE_EVERY: Duration = Duration::from_secs(2);

/// The progress of a run, on stderr.
pub(crate) struct Progress {
    total: u64,
    shown: Shown,
}

enum Shown {
    Bar(ProgressBar),
    Lines { next: Instant },
}

impl Progress {
    pub(crate) fn new(total: u64) -> Self {
        let shown = if stderr().is_terminal() {
            let style =
                ProgressStyle::with_template("{wide_bar:.cyan/blue} frame {pos}/{len}  {msg}")
                    .expect("the template is well formed")
                    .progress_chars("━━─");
            Shown::Bar(ProgressBar::new(total).with_style(style))
        } else {
            Shown::Lines {
                next: Instant::now() + LINE_EVERY,
            }
        };
        Self { total, shown }
    }

    /// Frame `at` is there; `note` is made only where it is shown.
    pub(crate) fn update(&mut self, at: u64, note: impl FnOnce() -> String) {
        match &mut self.shown {
            Shown::Bar(bar) => {
                bar.set_position(at);
                bar.set_message(note());
            }
            Shown::Lines { next } if Instant::now() >= *next => {
                *next += LINE_EVERY;
                eprintln!("frame {at}/{}  {}", self.total, note());
            }
            Shown::Lines { .. } => {}
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Shown::Bar(bar) = &self.shown {
            bar.finish_and_clear();
        }
    }
}
