//! Writes one set of planar throws in many file layouts; included by path into the tests that read them.

use augsim_data::Dataset;
use std::path::{Path, PathBuf};

/// Layout of a data file: header, separator, units and offsets.
pub struct Style {
    pub header: &'static str,
    pub separator: &'static str,
    /// Metres per length unit of the file, for x and for the height; negative if the height counts downwards.
    pub metres: [f64; 2],
    /// Offset added to the height before it is written, m.
    pub raised_m: f64,
    /// Seconds per unit of time in the file.
    pub seconds: f64,
    pub decimal_comma: bool,
    /// Text that follows the fourth cell of each row.
    pub extra: &'static str,
}

/// Layout with commas, metres and seconds.
pub const PLAIN: Style = Style {
    header: "run,t,x,y",
    separator: ",",
    metres: [1.0, 1.0],
    raised_m: 0.0,
    seconds: 1.0,
    decimal_comma: false,
    extra: "",
};

impl Style {
    /// Rows of the file in this layout, without the header.
    pub fn rows(&self, data: &Dataset) -> Vec<String> {
        let mut rows = Vec::new();
        for t in data.trajectories() {
            for k in 0..t.len() {
                let (x, z) =
                    (t.column(0)[k] / self.metres[0], (t.column(1)[k] + self.raised_m) / self.metres[1]);
                let time = t.time_s()[k] / self.seconds;
                let cells = [t.id().to_owned(), format!("{time:.9}"), format!("{x:.7}"), format!("{z:.7}")];
                let row = cells.join(self.separator) + self.extra;
                rows.push(if self.decimal_comma { row.replace('.', ",") } else { row });
            }
        }
        rows
    }

    /// Text of the whole file in this layout.
    pub fn text(&self, data: &Dataset) -> String {
        self.rows(data).into_iter().fold(format!("{}\n", self.header), |text, row| text + &row + "\n")
    }
}

/// Writes the throws in twelve layouts, the last with one file per throw; returns name and path of each.
///
/// The columns of `data` are x_m and z_m.
pub fn write_in_twelve_layouts(data: &Dataset, folder: &Path) -> Vec<(&'static str, PathBuf)> {
    let write = |name: &'static str, text: String| {
        let path = folder.join(name);
        std::fs::write(&path, text).expect("a writable temporary folder");
        (name, path)
    };
    let plain = PLAIN.text(data);
    let shuffled = {
        let mut rows = PLAIN.rows(data);
        let n = rows.len();
        // A stride without a common factor with the number of rows visits each row once.
        let stride = (n / 3..n)
            .find(|s| (1..=*s).filter(|k| s.is_multiple_of(*k) && n.is_multiple_of(*k)).count() == 1)
            .expect("a stride");
        rows = (0..n).map(|k| rows[k * stride % n].clone()).collect();
        rows.into_iter().fold("run,t,x,y\n".to_owned(), |text, row| text + &row + "\n")
    };
    let blank = {
        let drop_cell = |(i, row): (usize, String)| match i % 23 {
            7 => row.rsplit_once(',').expect("cells").0.to_owned() + ",",
            _ => row,
        };
        let rows = PLAIN.rows(data).into_iter().enumerate().map(drop_cell);
        rows.fold("run,t,x,y\n".to_owned(), |text, row| text + &row + "\n")
    };
    let styles = [
        ("centimetres.csv", Style { header: "run,time,x_cm,y_cm", metres: [0.01, 0.01], ..PLAIN }.text(data)),
        (
            "millimetres.csv",
            Style { header: "trial,time [ms],x (mm),z (mm)", metres: [1e-3, 1e-3], seconds: 1e-3, ..PLAIN }
                .text(data),
        ),
        (
            "semicolons.csv",
            Style { header: "Versuch;Zeit;x;y", separator: ";", decimal_comma: true, ..PLAIN }.text(data),
        ),
        (
            "tabs.txt",
            Style { header: "throw\tt (s)\tx (m)\theight (m)", separator: "\t", ..PLAIN }.text(data),
        ),
        ("mark.csv", format!("\u{feff}{plain}")),
        ("comments.csv", format!("# tracked by hand\n# 60 fps\n{plain}# end\n")),
        (
            "extra.csv",
            Style { header: "run,t,x,y,frame,comment", extra: ",17,\"fine, no spin\"", ..PLAIN }.text(data),
        ),
        ("down.csv", Style { metres: [1.0, -1.0], ..PLAIN }.text(data)),
        ("table.csv", Style { raised_m: 0.85, ..PLAIN }.text(data)),
        ("blank.csv", blank),
        ("shuffled.csv", shuffled),
    ];
    let mut written: Vec<_> = styles.into_iter().map(|(name, text)| write(name, text)).collect();
    let files_folder = folder.join("each");
    std::fs::create_dir(&files_folder).expect("a folder");
    for (k, t) in data.trajectories().iter().enumerate() {
        let rows = PLAIN.rows(&Dataset::new(data.columns().to_vec(), vec![t.clone()]).expect("well formed"));
        let rows = rows.iter().map(|r| r.split_once(',').expect("cells").1);
        let text = rows.fold("t,x,y\n".to_owned(), |text, row| text + row + "\n");
        std::fs::write(files_folder.join(format!("throw_{k:02}.csv")), text).expect("a writable folder");
    }
    written.push(("one file each", files_folder));
    written
}
