//! The report as a browser shows it: on a desk, on a telephone and on paper. Without Chromium nothing is looked at, and the
//! test says so; `cargo xtask test` installs it.

mod common;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use common::{assert_refused, assert_success, folder, program, run};
use imu_stand::browser::{Browser, VARIABLE};

/// Where it is missing, the rest of the test is left out, in words.
fn browser() -> Option<Browser> {
    match Browser::find() {
        Ok(browser) => Some(browser),
        Err(error) => {
            assert!(
                std::env::var_os("CI").is_none(),
                "CI without a browser: {error}"
            );
            eprintln!("NOT TESTED: {error}; `apt-get install chromium`, and again");
            None
        }
    }
}

/// Folder and report of a run of ten minutes with three axes and something hidden in it.
fn reported() -> &'static (PathBuf, String) {
    static MADE: OnceLock<(PathBuf, String)> = OnceLock::new();
    MADE.get_or_init(|| {
        let folder = folder("browser");
        let words =
            "run --native --hide common-noise --seed 62 --quiet --out run.csv --report r.html";
        let mut command = program(&words.split(' ').collect::<Vec<_>>());
        let output = command.current_dir(&folder).output().expect("it starts");
        assert_success(&output);
        let page = std::fs::read_to_string(folder.join("r.html")).expect("a report");
        (folder, page)
    })
}

/// Shows a page in a frame of each width, all of it unfolded, and writes down what is wrong with it.
const LOOK: &str = r#"<!DOCTYPE html><html><body><script>
const page = PAGE;
const wrong = [];
window.onerror = (what) => wrong.push(`script: ${what}`);
let left = WIDTHS.length;
for (const width of WIDTHS) {
  const frame = document.createElement('iframe');
  frame.style = `width:${width}px;height:900px;border:0`;
  frame.onload = () => {
    const at = (what) => wrong.push(`${width} px: ${what}`);
    const shown = frame.contentDocument, root = shown.documentElement;
    shown.querySelectorAll('details').forEach((d) => d.open = true);
    if (root.clientWidth > width || root.clientWidth < width - 20) at(`shown at ${root.clientWidth}`);
    if (root.scrollWidth > root.clientWidth) at(`${root.scrollWidth} wide`);
    const figures = [...shown.querySelectorAll('figure')];
    if (figures.length < 7) at(`${figures.length} figures`);
    figures.forEach((figure, k) => {
      const drawings = [...figure.querySelectorAll('svg')].filter((s) => s.getBoundingClientRect().width > 0);
      const marks = drawings.flatMap((s) => [...s.querySelectorAll('path,polyline,polygon,circle,line,rect')]);
      const tall = drawings.every((s) => s.getBoundingClientRect().height > 20);
      if (drawings.length === 0 || marks.length < 10 || !tall) at(`figure ${k} is empty`);
      if (!figure.textContent.trim()) at(`figure ${k} has no caption`);
    });
    const far = shown.querySelectorAll('figure .narrow svg, header *, article *');
    far.forEach((e) => { if (e.getBoundingClientRect().right > width + 1) at(`${e.tagName} reaches beyond the page`); });
    const sentences = [...shown.querySelectorAll('.scroll td:last-child:not(.number)')];
    const broken = sentences.filter((e) => e.textContent.length > 40 && e.getBoundingClientRect().width < 150);
    if (broken.length) at(`${broken.length} cells of a table are a word wide`);
    if (shown.scripts.length) at('has a script');
    left -= 1;
    if (left === 0) {
      const said = document.createElement('p');
      said.textContent = 'SAID' + JSON.stringify(wrong) + 'SAID';
      document.body.replaceChildren(said);
    }
  };
  frame.srcdoc = page;
  document.body.append(frame);
}
</script></body></html>"#;

/// Shows a page as it is printed, in a frame of the width of an A4 page, and writes down which letters of its drawings are
/// smaller than 9 px, 7 pt.
const PRINTED: &str = r#"<!DOCTYPE html><html><body><script>
const frame = document.createElement('iframe');
frame.style = 'width:703px;height:900px;border:0';
frame.onload = () => {
  const wrong = [], shown = frame.contentDocument;
  shown.querySelectorAll('details').forEach((d) => d.open = true);
  const drawings = [...shown.querySelectorAll('figure svg')].filter((s) => s.getBoundingClientRect().width > 0);
  if (drawings.length < 7) wrong.push(`${drawings.length} drawings`);
  drawings.forEach((s, k) => {
    const letters = [...s.querySelectorAll('text')].map((t) => {
      const { a, b } = t.getScreenCTM();
      return Math.hypot(a, b) * parseFloat(getComputedStyle(t).fontSize);
    });
    if (!(Math.min(...letters) >= 9)) wrong.push(`drawing ${k}: letters of ${Math.min(...letters)} px`);
  });
  const said = document.createElement('p');
  said.textContent = 'SAID' + JSON.stringify(wrong) + 'SAID';
  document.body.replaceChildren(said);
};
frame.srcdoc = PAGE;
document.body.append(frame);
</script></body></html>"#;

/// Nothing but its own styles: whatever else it asks for is refused, and the console says so.
const NOTHING_ELSE: &str = "<head><meta http-equiv=\"Content-Security-Policy\" \
     content=\"default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'\">";

/// What a browser finds wrong with a page at 390 and 1280 px.
fn wrong_with(browser: &Browser, page: &str, beside: &Path) -> Vec<String> {
    let look = LOOK.replace("WIDTHS", "[390, 1280]");
    looked_at(browser, page, beside, &look)
}

/// What a browser finds wrong with a page by the script of another one.
fn looked_at(browser: &Browser, page: &str, beside: &Path, look: &str) -> Vec<String> {
    let page = page.replacen("<head>", NOTHING_ELSE, 1);
    assert!(page.contains(NOTHING_ELSE));
    let quoted = serde_json::to_string(&page).expect("JSON");
    // Its end would end the script, too.
    let quoted = quoted.replace("</", "<\\/");
    let look = look.replace("PAGE", &quoted);
    let (dom, console) = browser.dom(&look, beside).expect("it shows a page");
    let said = dom
        .split("SAID")
        .nth(1)
        .unwrap_or_else(|| panic!("no answer: {dom:.300} {console}"));
    let said = said
        .replace("&lt;", "<")
        .replace("&gt;", ">")
        .replace("&amp;", "&");
    let mut wrong: Vec<String> = serde_json::from_str(&said).expect("JSON");
    let complaints = console.lines().filter(|line| line.contains("CONSOLE"));
    wrong.extend(complaints.map(str::to_owned));
    wrong
}

#[test]
fn a_report_fits_a_telephone_and_a_desk_and_asks_for_nothing() {
    let Some(browser) = browser() else { return };
    let (folder, page) = reported();
    let wrong = wrong_with(&browser, page, &folder.join("look"));
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn a_report_that_is_wrong_is_seen_to_be() {
    let Some(browser) = browser() else { return };
    let (folder, page) = reported();
    let spoilt = page.replacen(
        "<body>",
        "<body><div style=\"width:2000px\">wide</div><figure><svg></svg></figure>\
         <img src=\"nowhere.png\"><script>nothing()</script>",
        1,
    );
    let wrong = wrong_with(&browser, &spoilt, &folder.join("spoilt")).join("\n");
    for what in [
        "390 px: 2",
        "1280 px: 2",
        "figure 0 is empty",
        "nowhere.png",
        "has a script",
        "nothing is not defined",
    ] {
        assert!(wrong.contains(what), "{what} is not seen:\n{wrong}");
    }
}

#[test]
fn letters_of_a_printed_figure_can_be_read() {
    let Some(browser) = browser() else { return };
    let (folder, page) = reported();
    let printed = page.replace("@media print", "@media all");
    assert_ne!(&printed, page);
    let wrong = looked_at(&browser, &printed, folder, PRINTED);
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn a_printed_report_of_ten_minutes_has_four_pages_at_most() {
    let Some(_) = browser() else { return };
    let (run_folder, _) = reported();
    let folder = folder("browser_print");
    let path = |name: &str| folder.join(name).display().to_string();
    // Three things planted at once have four causes, six figures of them, and sixteen checks that fail.
    let many = path("many.csv");
    let words = "run --native --hide uncalibrated --seed 2 --quiet --no-replicates --out";
    let mut words: Vec<&str> = words.split(' ').collect();
    words.push(&many);
    assert_success(&run(&words));
    for csv in [run_folder.join("run.csv").display().to_string(), many] {
        let (html, pdf) = (path("p.html"), path("p.pdf"));
        let said = assert_success(&run(&["report", &csv, "--out", &html, "--pdf", &pdf]));
        assert!(said.contains("p.pdf"), "{said}");
        let bytes = std::fs::read(&pdf).expect("a PDF");
        let text = String::from_utf8_lossy(&bytes);
        let pages = text.matches("/Type /Page\n").count() + text.matches("/Type /Page ").count();
        assert!((1..=4).contains(&pages), "{csv}: {pages} pages");
    }
    let left: Vec<_> = std::fs::read_dir(&folder)
        .expect("the folder")
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| name.starts_with("imu-stand-print"))
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn a_figure_is_drawn_as_svg_and_as_png() {
    let Some(_) = browser() else { return };
    let (run_folder, _) = reported();
    let folder = folder("browser_figures");
    let path = |name: &str| folder.join(name).display().to_string();
    let csv = run_folder.join("run.csv").display().to_string();
    let (html, figures) = (path("r.html"), path("figures"));
    let mut words = vec!["report", &csv, "--no-replicates", "--out", &html];
    words.extend(["--figures", &figures, "--png"]);
    assert_success(&run(&words));
    let named = |ending: &str| -> Vec<PathBuf> {
        let files = std::fs::read_dir(&figures).expect("the folder");
        let mut paths: Vec<PathBuf> = files.map(|file| file.expect("a file").path()).collect();
        paths.retain(|path| path.extension().is_some_and(|e| e == ending));
        paths.sort();
        paths
    };
    let (svg, png) = (named("svg"), named("png"));
    assert!(!svg.is_empty());
    assert!(
        svg.iter()
            .map(|svg| svg.with_extension("png"))
            .eq(png.clone())
    );
    for path in png {
        let bytes = std::fs::read(&path).expect("a PNG");
        let number = |at: usize| {
            bytes[at..at + 4]
                .iter()
                .fold(0, |n, b| n << 8 | u32::from(*b))
        };
        let (width, height) = imu_stand::report::standalone::SIZE;
        assert_eq!((number(16), number(20)), (2 * width, 2 * height));
        // Flat white would be a tenth of it.
        assert!(bytes.len() > 20_000, "{} bytes", bytes.len());
    }
    let alone = run(&["report", &csv, "--png"]);
    assert_eq!(alone.status.code(), Some(2), "--png needs a folder");
}

#[test]
fn without_a_browser_a_pdf_is_refused_before_the_work() {
    let folder = folder("browser_none");
    let pdf = folder.join("r.pdf");
    let output = program(&["report", "nowhere.csv", "--pdf"])
        .arg(&pdf)
        .env(VARIABLE, "/nowhere/chromium")
        .output()
        .expect("the program starts");
    // The file that is not there would be told else.
    assert_refused(
        &output,
        &["no Chromium is found", "apt-get install chromium"],
    );
}
