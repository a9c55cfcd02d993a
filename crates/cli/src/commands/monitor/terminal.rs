//! The terminal that the screen is drawn on: its other screen while it is shown, and its keys.

use std::time::Duration;

use imu_stand::monitor::{About, Action, Key, Screen, Snapshot};
use miette::{IntoDiagnostic, Result};
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

/// A terminal that is ours until it is dropped, also by a panic.
pub(super) struct Terminal {
    terminal: DefaultTerminal,
    pub screen: Screen,
    /// What the person has asked for, confirmed where it needs to be.
    pub asked: Option<Action>,
}

impl Terminal {
    pub fn start() -> Result<Self> {
        Ok(Self {
            terminal: ratatui::try_init().into_diagnostic()?,
            screen: Screen::default(),
            asked: None,
        })
    }

    /// Takes the keys that were pressed; whether anything is to be drawn anew.
    pub fn keys(&mut self) -> Result<bool> {
        let mut any = false;
        while self.asked.is_none() && event::poll(Duration::ZERO).into_diagnostic()? {
            any = true;
            if let Event::Key(key) = event::read().into_diagnostic()?
                && key.kind != KeyEventKind::Release
                && let Some(key) = known(key)
            {
                self.asked = self.screen.press(key);
            }
        }
        Ok(any)
    }

    pub fn draw(&mut self, s: &Snapshot, about: &About) -> Result<()> {
        let drawn = (self.terminal).draw(|frame| self.screen.draw(frame, s, about));
        drawn.map(drop).into_diagnostic()
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

/// The keys that mean something. Raw, a terminal sends Ctrl-C as a key.
fn known(key: KeyEvent) -> Option<Key> {
    let is_control = key.modifiers.contains(KeyModifiers::CONTROL);
    match key.code {
        KeyCode::Char('c') if is_control => Some(Key::End),
        KeyCode::Char(_) if is_control => None,
        KeyCode::Char(c) => Some(Key::Char(c)),
        KeyCode::Enter => Some(Key::Enter),
        KeyCode::Esc => Some(Key::Escape),
        KeyCode::Backspace => Some(Key::Backspace),
        KeyCode::Tab => Some(Key::Tab),
        _ => None,
    }
}
