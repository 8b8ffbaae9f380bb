//! `rockmap camera`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::camera::{
    Axes, Camera, Cameras, Conversion, Converted, PanTilt, cameras_as_json, cameras_as_text,
    find_camera, pixels_of_table, rays_of_table, read_camera_file,
};
use crate::error::Error;
use crate::input::Table;

const EXAMPLES: &str = "Examples:
  rockmap camera list fixtures/tiny/cameras.toml
  printf 'u_px,v_px\\n160,120\\n' | rockmap camera rays fixtures/tiny/cameras.toml
  rockmap camera pixels cameras.toml --camera mast --input points.csv --output pixels.csv";

/// What `rockmap camera` takes.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Args {
    #[command(subcommand)]
    question: Question,
}

#[derive(Debug, clap::Subcommand)]
enum Question {
    /// The rays of pixels: a table of pixels in, one of origins and unit directions out
    #[command(after_help = "Columns of the table: u_px, v_px; others are kept.")]
    Rays(TableArgs),
    /// The pixels of points: a table of points in, one of raw pixels out
    #[command(after_help = "Columns of the table: x_m, y_m, z_m; others are kept.")]
    Pixels(TableArgs),
    /// The cameras of a file: name, model, size, horizontal field of view
    List(ListArgs),
}

#[derive(Debug, clap::Args)]
struct TableArgs {
    /// The cameras: cameras.toml, or a file in another format
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Which of them; not needed where there is one
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Read the table from this CSV file instead of standard input
    #[arg(long, value_name = "PATH")]
    input: Option<PathBuf>,
    /// Write the table to this CSV file instead of standard output
    #[arg(long, value_name = "PATH")]
    output: Option<PathBuf>,
    /// Axes of rays and points
    #[arg(long, value_name = "FRAME", default_value = "body")]
    frame: Frame,
    /// Pan of the head, degrees, clockwise seen from above
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pan_deg: f64,
    /// Tilt of the head, degrees, up
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    tilt_deg: f64,
    /// Add columns of derivatives: of directions by pixels, of pixels by points
    #[arg(long)]
    jacobian: bool,
}

/// Axes, as they are typed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Frame {
    /// Forward, left, up
    Body,
    /// Right, down, forward
    Camera,
}

#[derive(Debug, clap::Args)]
struct ListArgs {
    /// The cameras: cameras.toml, or a file in another format
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Print them as JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn camera(args: &Args) -> Result<ExitCode, Error> {
    match &args.question {
        Question::Rays(args) => convert(args, rays_of_table),
        Question::Pixels(args) => convert(args, pixels_of_table),
        Question::List(args) => {
            let cameras = read(&args.file)?;
            let listed = if args.json {
                cameras_as_json(&cameras)
            } else {
                cameras_as_text(&cameras)
            };
            write(None, listed.as_bytes())?;
            Ok(ExitCode::SUCCESS)
        }
    }
}

/// The cameras of a file in any format; what is to be said of them goes to standard error.
fn read(file: &Path) -> Result<Cameras, Error> {
    let read = read_camera_file(file, &file.display().to_string())?;
    for note in &read.notes {
        eprintln!("note: {note}");
    }
    Ok(read.cameras)
}

/// From a camera and a table to another.
type Convert = fn(&Camera, &mut Table, &Conversion) -> Result<Converted, Error>;

fn convert(args: &TableArgs, convert: Convert) -> Result<ExitCode, Error> {
    let cameras = read(&args.file)?;
    let shown = args.file.display().to_string();
    let camera = find_camera(&cameras, args.camera.as_deref(), &shown)?;
    let mut table = match &args.input {
        Some(path) => Table::open(path, &path.display().to_string())?,
        None => Table::from_reader(Box::new(std::io::stdin()), "standard input")?,
    };
    let conversion = Conversion {
        axes: match args.frame {
            Frame::Body => Axes::Body,
            Frame::Camera => Axes::Camera,
        },
        head: PanTilt {
            pan: args.pan_deg.to_radians(),
            tilt: args.tilt_deg.to_radians(),
        },
        jacobian: args.jacobian,
    };
    let converted = convert(camera, &mut table, &conversion)?;
    write(args.output.as_deref(), &converted.csv)?;
    if converted.n_problems > 0 {
        let (problems, rows) = (converted.n_problems, converted.n_rows);
        eprintln!("warning: {problems} of {rows} records have no answer, see the column problem");
        return Ok(ExitCode::from(1));
    }
    Ok(ExitCode::SUCCESS)
}

/// To a file, or to standard output, whose reader may have gone.
fn write(path: Option<&Path>, bytes: &[u8]) -> Result<(), Error> {
    let Some(path) = path else {
        return match std::io::stdout().write_all(bytes) {
            Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
                Err(Error::io(Path::new("standard output"), "write", e))
            }
            _ => Ok(()),
        };
    };
    std::fs::write(path, bytes).map_err(|e| Error::io(path, "write", e))
}
