//! `report.html`: one file that opens anywhere, made of sections that the caller composes.
//!
//! A [`Report`] is a list of [`Section`]s, each a list of [`Item`]s: text, [`Plot`], [`Table`], [`SideView`]. [`Report::of_run`]
//! builds the usual ones of a run from its CSV, summary and manifest; a study adds its own or builds all of them.
//! The page needs no network and no fonts, follows the reader's light or dark setting, prints, and shows values under the pointer.
//!
//! Quantities are handed over in SI; the page chooses prefixes (mm, kN) and says them on the axis.

mod decimate;
mod driving;
mod energy;
mod frame;
mod page;
mod plot;
mod png;
mod scale;
mod scene;
pub mod sections;
mod side_view;
mod silhouette;
mod standalone;
mod svg;

pub use frame::vehicle_frame;
pub use plot::{Axis, Band, Level, Plot, Series, Style};
pub use scene::{Scene, SceneMesh};
pub use side_view::{Disc, SideView};

use crate::csv::CsvTable;
use crate::error::Result;
use crate::folder::RunFolder;
use crate::manifest::Manifest;
use crate::summary::Headline;

/// A page.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// Headline of the page.
    pub title: String,
    /// A sentence below it.
    pub subtitle: String,
    /// Small facts below that: name and value.
    pub chips: Vec<(String, String)>,
    /// What follows.
    pub sections: Vec<Section>,
}

/// A part of the page.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Section {
    /// Its heading.
    pub title: String,
    /// Closed until the reader opens it.
    pub collapsed: bool,
    /// What it shows, in order; neighbouring plots share a row where the page is wide enough.
    pub items: Vec<Item>,
}

impl Section {
    /// A section that is open.
    pub fn new(title: impl Into<String>, items: Vec<Item>) -> Section {
        Section { title: title.into(), collapsed: false, items }
    }

    /// The same, closed until the reader opens it.
    pub fn collapsed(self) -> Section {
        Section { collapsed: true, ..self }
    }
}

/// One thing in a section.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// A paragraph.
    Text(String),
    /// Lines over an axis.
    Plot(Plot),
    /// Rows of text and numbers.
    Table(Table),
    /// Bed and bodies seen from the side.
    SideView(SideView),
    /// A PNG made elsewhere.
    Picture {
        /// The file's content.
        png: Vec<u8>,
        /// What it shows.
        caption: String,
    },
}

/// A table; columns that hold numbers are set flush right.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// A line above it; empty = none.
    pub caption: String,
    /// Column headings; empty = none.
    pub head: Vec<String>,
    /// Rows of cells.
    pub rows: Vec<Vec<String>>,
}

impl Report {
    /// The report of one run: headlines, wheel results over time, `figures`, everything else recorded, run facts.
    pub fn of_run(
        title: impl Into<String>,
        csv: &CsvTable,
        summary: &[Headline],
        manifest: &Manifest,
        figures: Vec<SideView>,
    ) -> Report {
        let mut sections = vec![sections::headlines(summary), sections::over_time(csv, summary)];
        sections.splice(1..1, driving::driving(csv).into_iter().chain(energy::energy(csv)));
        // One colour scale, so that the views can be compared.
        let max = figures.iter().map(SideView::scale_max).fold(0.0, f64::max);
        let views = figures.into_iter().map(|view| Item::SideView(view.scale_to_default(max)));
        sections.push(Section::new("Bed and wheel", views.collect()));
        sections.extend(sections::all_scalars(csv));
        sections.extend(sections::run_facts(manifest));
        sections.retain(|s| !s.items.is_empty());
        Report { title: title.into(), subtitle: String::new(), chips: sections::chips(manifest), sections }
    }

    /// With a picture in a section of its own behind the first one.
    #[must_use]
    pub fn with_picture(mut self, title: &str, png: Vec<u8>, caption: String) -> Report {
        let at = self.sections.len().min(1);
        self.sections.insert(at, Section::new(title, vec![Item::Picture { png, caption }]));
        self
    }

    /// The page as HTML.
    pub fn html(&self) -> String {
        page::html(self)
    }

    /// Writes `report.html`.
    ///
    /// # Errors
    /// Those of [`RunFolder::write_with`].
    pub fn write(&self, folder: &RunFolder) -> Result<()> {
        folder.write("report.html", self.html().as_bytes())
    }
}
