# Makes the recordings of docs/tutorial.md, in this folder: a cart with dry friction, and measurement noise of 0.3 mm (standard deviation).
set -eu
make() { # FOLDER CENTIMETRES
    augsim simulate truth.toml --start x_m=0.$2 --duration-s 4 --out exact.csv --force -q > exact.log
    awk -F, -v OFS=, -v seed="$2" '
        BEGIN { srand(seed); pi = atan2(0, -1) }
        NR > 1 { $3 = sprintf("%.4f", $3 + 0.0003 * sqrt(-2 * log(1 - rand())) * cos(2 * pi * rand())) }
        { print }' exact.csv > "$1/run-$2.csv"
    rm exact.csv exact.log
}
mkdir -p recordings new
for start in 10 12 14 16 18 22; do make recordings $start; done
for start in 20 24; do make new $start; done
