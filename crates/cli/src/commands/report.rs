//! `imu-stand report`, and `--report` of the commands that diagnose.

use std::path::{Path, PathBuf};

use clap::Args;
use diagnosis::DiagnoseOptions;
use imu_stand::browser::Browser;
use imu_stand::report::{Subject, figure_files, report, standalone};
use imu_stand::text::shell_word;
use miette::Result;

use super::progress::working;
use super::{Input, Outputs, Replicates};

/// What `report` takes.
#[derive(Args)]
pub struct Arguments {
    /// The capture: .csv, .csv.gz, .npz, .npy, .parquet, .mat, .h5, .mcap, .bag, .ulg, .txt
    capture: PathBuf,
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    replicates: Replicates,
    /// Seed of whatever is random
    #[arg(long, default_value_t = 0, value_parser = super::seed, allow_negative_numbers = true)]
    seed: u64,
    /// The report to write
    #[arg(long, default_value = "report.html")]
    out: PathBuf,
    /// Print the report as PDF, too; needs Chromium, Chrome or Edge
    #[arg(long, value_name = "FILE")]
    pdf: Option<PathBuf>,
    /// Write the figure of each cause as SVG, too, into this folder
    #[arg(long, value_name = "FOLDER")]
    figures: Option<PathBuf>,
    /// Draw them as PNG, too; needs Chromium, Chrome or Edge
    #[arg(long, requires = "figures")]
    png: bool,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    Outputs::beside([&arguments.capture])
        .page("--out", Some(&arguments.out))?
        .result("--pdf", arguments.pdf.as_ref())?;
    super::outputs::named_as_pdf("--pdf", arguments.pdf.as_ref())?;
    if let Some(folder) = arguments.figures.as_ref().filter(|f| f.exists()) {
        miette::ensure!(
            folder.is_dir(),
            help = "name a folder, which is made where it is not there",
            "--figures: {} is a file",
            folder.display()
        );
    }
    // Before the work: without a browser there is no PDF.
    let printer = match &arguments.pdf {
        Some(path) if path.as_os_str() == super::outputs::DASH => {
            misused!(help = "write `--pdf report.pdf`", "--pdf: it takes a file")
        }
        Some(path) => Some((Browser::find()?, path)),
        None => None,
    };
    let artist = arguments.png.then(Browser::find).transpose()?;
    let read = arguments.input.read(&arguments.capture)?;
    let hash = super::digest(&arguments.capture)?;
    let options = DiagnoseOptions {
        seed: arguments.seed,
        file: super::name(&arguments.capture),
        hash: Some(hash.clone()),
        no_evidence: false,
        replicates: arguments.replicates.count(),
        matters: arguments.replicates.matters(),
    };
    let say = || format!("diagnosing {}", options.file);
    let diagnosed = working(arguments.input.quiet, say, || {
        diagnosis::diagnose(&read.record, &options)
    });
    let diagnosed = diagnosed.map_err(super::explain)?;
    let subject = Subject {
        record: &read.record,
        diagnosed: &diagnosed,
        rate_hz: None,
        command: &command(),
        seed: arguments.seed,
        hash: Some(&hash),
        hidden: None,
    };
    if let Some(folder) = &arguments.figures {
        write_figures(folder, &subject, artist.as_ref(), arguments.input.quiet)?;
    }
    let page = write(&arguments.out, &subject, arguments.input.quiet)?;
    if let Some((browser, path)) = printer {
        browser.print(&page, path)?;
        if !arguments.input.quiet {
            say!("report: {}", path.display());
        }
    }
    Ok(())
}

fn write_figures(
    folder: &Path,
    subject: &Subject<'_>,
    artist: Option<&Browser>,
    quiet: bool,
) -> Result<()> {
    let figures = figure_files(subject).map_err(|error| miette::miette!("no figures: {error}"))?;
    std::fs::create_dir_all(folder).map_err(|error| super::outputs::failed(folder, &error))?;
    if figures.is_empty() && !quiet {
        say!("no figure: no cause was found that one shows");
    }
    for (name, svg) in figures {
        let path = folder.join(name);
        super::write(&path, &svg)?;
        let drawn = path.with_extension("png");
        if let Some(artist) = artist {
            artist.draw(&standalone::page(&svg), standalone::SIZE, &drawn)?;
        }
        if !quiet {
            say!("figure: {}", path.display());
            if artist.is_some() {
                say!("figure: {}", drawn.display());
            }
        }
    }
    Ok(())
}

/// Makes a report, writes it and returns it.
pub fn write(path: &Path, subject: &Subject<'_>, quiet: bool) -> Result<String> {
    let page = working(quiet, || "making the report".to_owned(), || report(subject));
    let page = page.map_err(|error| {
        miette::miette!(
            help = "`imu-stand diagnose` without a report gives the same answers as text and JSON",
            "no report: {error}"
        )
    })?;
    super::write(path, &page)?;
    if !quiet {
        say!("report: {}", path.display());
    }
    Ok(page)
}

/// The command as it was typed; the program by its name.
pub fn command() -> String {
    let words = std::env::args().skip(1).map(|word| shell_word(&word));
    std::iter::once("imu-stand".to_owned())
        .chain(words)
        .collect::<Vec<_>>()
        .join(" ")
}
