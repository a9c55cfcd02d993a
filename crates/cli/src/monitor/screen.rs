//! The view as a screen of a terminal, 60 x 20 characters and more: what is shown, and what keys do. It is drawn on a buffer, and
//! knows no terminal.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;
use ratatui::widgets::canvas::{Canvas, Context, Line as Stroke, Points};

use super::page::number;
use super::{AXES, Action, Point, Snapshot};

/// Colours of the axes; they have names, too.
const COLOURS: [Color; 3] = [Color::Cyan, Color::Yellow, Color::Magenta];
/// Samples of a bias null: half a minute at 20 Hz, as `board bias-null` takes.
const NULL_SAMPLES: u16 = 600;
/// Columns that the labels of the vertical axis take.
const LABELS: u16 = 8;

/// Which curves are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axes {
    /// All three, without their bands.
    #[default]
    All,
    /// One, with its band.
    One(usize),
}

/// A key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// A character.
    Char(char),
    /// The end of an input.
    Enter,
    /// Away from it.
    Escape,
    /// Takes back a character.
    Backspace,
    /// The next axis.
    Tab,
    /// Ends it, whatever is being asked.
    End,
}

/// What is being asked of the person.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
enum Prompt {
    #[default]
    None,
    Help,
    Duty(String),
    Confirm(Action),
}

/// What a person has chosen.
#[derive(Clone, Debug, Default)]
pub struct Screen {
    axes: Axes,
    prompt: Prompt,
    ends: bool,
}

/// What is shown beside the figures.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// Name of the port.
    pub port: String,
    /// The board, as it says.
    pub board: String,
    /// What happened to the port, where something did.
    pub line: String,
    /// What became of the last command.
    pub said: String,
}

impl Screen {
    /// Whether it is to end.
    #[must_use]
    pub fn ends(&self) -> bool {
        self.ends
    }

    /// A key was pressed. What is returned has been confirmed, where it needs to be.
    pub fn press(&mut self, key: Key) -> Option<Action> {
        let prompt = std::mem::take(&mut self.prompt);
        match (prompt, key) {
            (_, Key::End) => self.ends = true,
            (Prompt::Duty(text), key) => self.duty(text, key),
            (Prompt::Confirm(action), Key::Char('y')) => return Some(action),
            (Prompt::Confirm(_) | Prompt::Help, _) => {}
            (Prompt::None, Key::Char(c)) => return self.choose(c),
            (Prompt::None, Key::Tab) => {
                self.axes = match self.axes {
                    Axes::All => Axes::One(0),
                    Axes::One(2) => Axes::All,
                    Axes::One(k) => Axes::One(k + 1),
                }
            }
            (Prompt::None, _) => {}
        }
        None
    }

    fn choose(&mut self, c: char) -> Option<Action> {
        match c {
            'q' => self.ends = true,
            'x' => self.axes = Axes::One(0),
            'y' => self.axes = Axes::One(1),
            'z' => self.axes = Axes::One(2),
            'a' => self.axes = Axes::All,
            'm' => self.prompt = Prompt::Duty(String::new()),
            'b' => self.prompt = Prompt::Confirm(Action::BiasNull(NULL_SAMPLES)),
            's' | ' ' => return Some(Action::Stop),
            '?' | 'h' => self.prompt = Prompt::Help,
            _ => {}
        }
        None
    }

    /// A command for the motor is being typed.
    fn duty(&mut self, mut text: String, key: Key) {
        self.prompt = match key {
            Key::Char(c) if c.is_ascii_digit() && text.len() < 4 => {
                text.push(c);
                Prompt::Duty(text)
            }
            Key::Char('-') if text.is_empty() => Prompt::Duty("-".to_owned()),
            Key::Backspace => {
                text.pop();
                Prompt::Duty(text)
            }
            Key::Enter => match text.parse::<i16>() {
                Ok(duty) if (-255..=255).contains(&duty) => Prompt::Confirm(Action::Motor(duty)),
                _ => Prompt::Duty(String::new()),
            },
            Key::Escape => Prompt::None,
            _ => Prompt::Duty(text),
        };
    }

    /// Draws it.
    pub fn draw(&self, frame: &mut Frame<'_>, s: &Snapshot, about: &About) {
        let one = Constraint::Length(1);
        let [
            title,
            counts,
            clocks,
            names,
            x,
            y,
            z,
            state,
            curve,
            counters,
            keys,
        ] = Layout::vertical([
            one,
            one,
            one,
            one,
            one,
            one,
            one,
            one,
            Constraint::Min(4),
            one,
            one,
        ])
        .areas(frame.area());
        let wide = frame.area().width >= 80;
        let head = format!(" imu-stand  {}  {}", about.port, about.board);
        put(
            frame,
            title,
            head,
            Style::new().add_modifier(Modifier::REVERSED),
        );
        let lossy = s.missing > 0 || s.rejected > 0 || s.restarts > 0;
        put(frame, counts, counted(s, wide), alarm(lossy));
        put(frame, clocks, s.clocks(), Style::new());
        let heads = format!(
            "{:4}{:>10}{:>9}{:>8}{:>10}",
            "gyro", "deg/s", "rms", "degC", "acc m/s^2"
        );
        put(
            frame,
            names,
            heads,
            Style::new().add_modifier(Modifier::DIM),
        );
        let beside = [
            format!("  supply {} V", number(s.supply_v, 6, 3)),
            s.pwm
                .map_or_else(String::new, |pwm| format!("  motor {pwm:>6}")),
            format!("  {:.4} Hz", s.rate_hz),
        ];
        for (k, (area, beside)) in [x, y, z].into_iter().zip(beside).enumerate() {
            let row = row(s, k) + &beside;
            put(frame, area, row, Style::new().fg(COLOURS[k]));
        }
        put(frame, state, s.state(), alarm(!s.flags.is_empty()));
        self.curve(frame, curve, s);
        let (words, style) = self.words(s, about);
        put(frame, counters, words, style);
        let help = "q quit  x y z a axis  m motor  s stop  b bias null  ? help";
        put(
            frame,
            keys,
            help.to_owned(),
            Style::new().add_modifier(Modifier::REVERSED),
        );
    }

    /// The line above the keys: a question, else what happened last, else the board's counters.
    fn words(&self, s: &Snapshot, about: &About) -> (String, Style) {
        let asks = Style::new().fg(Color::Black).bg(Color::Yellow);
        match &self.prompt {
            Prompt::Duty(text) => (
                format!("motor, -255 to 255: {text}_  (Enter, Esc leaves it)"),
                asks,
            ),
            Prompt::Confirm(action) => (format!("{} y/n", action.question()), asks),
            Prompt::Help => (
                "deviations with 95 % bands; s or space stops the motor at once".to_owned(),
                asks,
            ),
            Prompt::None if !about.line.is_empty() => (about.line.clone(), alarm(true)),
            Prompt::None if !about.said.is_empty() => (about.said.clone(), Style::new()),
            Prompt::None => {
                let is_alarm = s.counters.as_ref().is_some_and(|c| !c.is_empty());
                (
                    format!("board's counters: {}", s.counted()),
                    alarm(is_alarm),
                )
            }
        }
    }

    /// Deviations over averaging times, both by their logarithms.
    fn curve(&self, frame: &mut Frame<'_>, area: Rect, s: &Snapshot) {
        let chosen: Vec<usize> = match self.axes {
            Axes::All => (0..3).collect(),
            Axes::One(k) => vec![k],
        };
        let [title, plot, below] = Layout::vertical([
            Constraint::Length(1),
            Constraint::Min(2),
            Constraint::Length(1),
        ])
        .areas(area);
        put_line(frame, title, heading(s, &chosen, title.width >= 80));
        let points = chosen.iter().flat_map(|k| &s.allan[*k]);
        let is_band = matches!(self.axes, Axes::One(_));
        let Some(span) = Span2::of(points, is_band) else {
            put(
                frame,
                plot,
                "not enough samples yet".to_owned(),
                Style::new(),
            );
            return;
        };
        let [labels, canvas] =
            Layout::horizontal([Constraint::Length(LABELS), Constraint::Min(8)]).areas(plot);
        let dots = f64::from(canvas.width) * 2.0;
        let drawn = Canvas::default()
            .marker(Marker::Braille)
            .x_bounds(span.x)
            .y_bounds(span.y)
            .paint(|context| {
                for k in &chosen {
                    if is_band {
                        // In one layer with the curve: where both are in a character, it has the dots of both.
                        band(context, &s.allan[*k], span.x, dots);
                    }
                    line(context, &s.allan[*k], COLOURS[*k]);
                }
            });
        frame.render_widget(drawn, canvas);
        left(frame, labels, span.y);
        bottom(frame, below, canvas, span.x);
    }
}

/// What is drawn, and the value at the longest time that is known to 10 % or so.
fn heading(s: &Snapshot, chosen: &[usize], wide: bool) -> Line<'static> {
    let mut spans = vec![Span::raw("Allan deviation, deg/s ")];
    for k in chosen {
        let colour = Style::new().fg(COLOURS[*k]);
        spans.push(Span::styled(format!(" gyro {}", AXES[*k]), colour));
    }
    if let [k] = chosen {
        spans.push(Span::raw(", 95 % band"));
        if let Some(point) = s.allan[*k].iter().rev().find(|p| wide && p.tau_s <= 1.0) {
            let at = crate::report::plot::tidy(point.tau_s, 3);
            let value = super::page::interval(point);
            spans.push(Span::raw(format!("; {at} s: {value}")));
        }
    }
    Line::from(spans)
}

/// Samples and losses.
fn counted(s: &Snapshot, wide: bool) -> String {
    let time = s.seconds as u64;
    let (h, m, sec) = (time / 3600, time / 60 % 60, time % 60);
    let shown = |count: u64, what: &str| match wide || count > 0 {
        true => format!(", {count} {what}"),
        false => String::new(),
    };
    let (restarts, rejected) = (
        shown(s.restarts, "restarts"),
        shown(s.rejected.into(), "rejected"),
    );
    let (losses, samples) = (s.losses(), s.samples);
    format!("{h}:{m:02}:{sec:02}  {losses}{restarts}{rejected}, {samples} samples")
}

/// An axis over the last second.
fn row(s: &Snapshot, k: usize) -> String {
    let gyro = &s.gyros[k];
    format!(
        "{:4}{}{}{}{}",
        AXES[k],
        number(gyro.mean_dps, 10, 4),
        number(gyro.rms_dps, 9, 4),
        number(gyro.temp_c, 8, 2),
        number(s.acc_mps2[k], 10, 3)
    )
}

fn alarm(is: bool) -> Style {
    match is {
        true => Style::new().fg(Color::Red).add_modifier(Modifier::BOLD),
        false => Style::new(),
    }
}

fn put(frame: &mut Frame<'_>, area: Rect, text: String, style: Style) {
    frame.render_widget(Paragraph::new(text).style(style), area);
}

fn put_line(frame: &mut Frame<'_>, area: Rect, line: Line<'_>) {
    frame.render_widget(Paragraph::new(line), area);
}

/// What the axes span, by logarithms of ten.
struct Span2 {
    x: [f64; 2],
    y: [f64; 2],
}

impl Span2 {
    fn of<'a>(points: impl Iterator<Item = &'a Point>, with_band: bool) -> Option<Self> {
        let (mut x, mut y) = (
            [f64::INFINITY, f64::NEG_INFINITY],
            [f64::INFINITY, f64::NEG_INFINITY],
        );
        let widen = |span: &mut [f64; 2], value: f64| {
            *span = [span[0].min(value), span[1].max(value)];
        };
        for point in points.filter(|p| p.deviation > 0.0) {
            widen(&mut x, point.tau_s.log10());
            widen(&mut y, point.deviation.log10());
            if with_band {
                widen(&mut y, point.low.max(point.deviation / 10.0).log10());
                widen(&mut y, point.high.min(point.deviation * 10.0).log10());
            }
        }
        if !x[0].is_finite() {
            return None;
        }
        // A first point alone still has a place.
        x[1] = x[1].max(x[0] + 0.5);
        let middle = (y[0] + y[1]) / 2.0;
        let half = ((y[1] - y[0]) / 2.0).max(0.1) * 1.05;
        Some(Span2 {
            x,
            y: [middle - half, middle + half],
        })
    }
}

/// The curve.
fn line(context: &mut Context<'_>, points: &[Point], color: Color) {
    let shown: Vec<(f64, f64)> = logarithms(points, |p| p.deviation);
    for pair in shown.windows(2) {
        let [(x1, y1), (x2, y2)] = [pair[0], pair[1]];
        context.draw(&Stroke {
            x1,
            y1,
            x2,
            y2,
            color,
        });
    }
    context.draw(&Points::new(&shown, color));
}

/// The edges of its band, dotted.
fn band(context: &mut Context<'_>, points: &[Point], x: [f64; 2], dots: f64) {
    let edges: [fn(&Point) -> f64; 2] = [|p| p.low, |p| p.high];
    for edge in edges {
        let edge = logarithms(points, edge);
        let step = 2.0 * (x[1] - x[0]) / dots.max(1.0);
        let mut dotted = Vec::new();
        for pair in edge.windows(2) {
            let [(x1, y1), (x2, y2)] = [pair[0], pair[1]];
            let count = ((x2 - x1) / step).ceil().max(1.0) as usize;
            dotted.extend((0..=count).map(|k| {
                let part = k as f64 / count as f64;
                (x1 + part * (x2 - x1), y1 + part * (y2 - y1))
            }));
        }
        context.draw(&Points::new(&dotted, Color::DarkGray));
    }
}

fn logarithms(points: &[Point], of: impl Fn(&Point) -> f64) -> Vec<(f64, f64)> {
    let positive = points.iter().filter(|p| of(p) > 0.0);
    positive.map(|p| (p.tau_s.log10(), of(p).log10())).collect()
}

/// 1, 2 and 5 times the powers of ten between two logarithms; the powers alone where that is enough.
fn ticks([low, high]: [f64; 2], most: usize) -> Vec<f64> {
    let of = |steps: &[f64]| -> Vec<f64> {
        let powers = (low.floor() as i32)..=(high.ceil() as i32);
        let all = powers.flat_map(|p| steps.iter().map(move |s| s.log10() + f64::from(p)));
        all.filter(|v| (low..=high).contains(v)).collect()
    };
    let fine = of(&[1.0, 2.0, 5.0]);
    if fine.len() <= most { fine } else { of(&[1.0]) }
}

/// A tick as people write it.
fn label(logarithm: f64) -> String {
    crate::report::plot::tidy(10f64.powf(logarithm), 1)
}

/// Labels of the vertical axis.
fn left(frame: &mut Frame<'_>, area: Rect, y: [f64; 2]) {
    let mut last = None;
    for tick in ticks(y, usize::from(area.height) / 2) {
        let part = (y[1] - tick) / (y[1] - y[0]);
        let row =
            area.y + ((part * f64::from(area.height)) as u16).min(area.height.saturating_sub(1));
        if last.replace(row) == Some(row) {
            continue;
        }
        let at = Rect::new(area.x, row, area.width, 1).intersection(area);
        put(frame, at, format!("{:>7}", label(tick)), Style::new());
    }
}

/// Labels of the horizontal axis.
fn bottom(frame: &mut Frame<'_>, area: Rect, canvas: Rect, x: [f64; 2]) {
    put(frame, area, "tau, s".to_owned(), Style::new());
    let mut free = canvas.x;
    for tick in ticks(x, usize::from(canvas.width) / 8) {
        let part = (tick - x[0]) / (x[1] - x[0]);
        let text = label(tick);
        let column = canvas.x + (part * f64::from(canvas.width.saturating_sub(1))) as u16;
        let width = text.len() as u16;
        let from = column.saturating_sub(width / 2).max(canvas.x);
        if from < free || from + width > area.right() {
            continue;
        }
        put(frame, Rect::new(from, area.y, width, 1), text, Style::new());
        free = from + width + 1;
    }
}
