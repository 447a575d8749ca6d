# gnuplot -c panels.gp RESULTS.csv OUTPUT COLUMNS "SCENE:METRIC ...": draws OUTPUT, a .svg or .png: a grid of panels,
# each one scene's error by one metric (rmse or flip) against CPU time, on log-log axes, and below them one legend.
results = ARG1
output = ARG2
panels = ARG4
count = words(panels)
columns = count < int(ARG3) ? count : int(ARG3)
rows = (count + columns - 1) / columns

# Colours that people of all sorts of colour vision tell apart (Okabe and Ito, Color Universal Design, 2008).
curves = "weft-adaptive weft-fixed povray-am1 povray-am2 povray-fixed tachyon"
array title[6] = ["weft --error", "weft --samples", "POV-Ray +AM1", "POV-Ray +AM2", "POV-Ray, every pixel", "Tachyon"]
set linetype 1 lc rgb "#0072B2" lw 2.6 pt 7 ps 0.9
set linetype 2 lc rgb "#56B4E9" lw 1.6 pt 6 ps 0.9
set linetype 3 lc rgb "#D55E00" lw 1.6 pt 9 ps 1
set linetype 4 lc rgb "#CC79A7" lw 1.6 pt 11 ps 1
set linetype 5 lc rgb "#E69F00" lw 1.6 pt 4 ps 0.9
set linetype 6 lc rgb "#009E73" lw 1.6 pt 12 ps 1.1

# Sizes in pixels, of a panel with what is around it, and of the legend.
panel_width = 430
panel_height = 340
legend_height = 62
width = columns * panel_width
height = rows * panel_height + legend_height

scene_of(panel) = panel[1:strstrt(panel, ":") - 1]
metric_of(panel) = panel[strstrt(panel, ":") + 1:]
number(curve) = sum [i = 1:words(curves)] (word(curves, i) eq curve ? i : 0)
measured = system(sprintf("awk -F, 'NR > 1 && !seen[$4]++ { print $4 }' '%s'", results))
# The CSV's head and the lines of one scene, and of one curve if it is named.
lines(scene, curve) = sprintf("< awk -F, 'NR == 1 || ($1 == \"%s\" && (\"%s\" == \"\" || $4 == \"%s\"))' '%s'", \
                              scene, curve, curve, results)

set datafile separator ","
set datafile columnheaders
set border 3 lc rgb "#606060"
set tics nomirror textcolor rgb "#303030"
set grid xtics ytics lc rgb "#e4e4e4" lt 1 lw 0.7
set logscale xy
do for [decade = -5:5] {
    do for [step in "1 2 5"] {
        set xtics add (sprintf("%g", step * 10.0**decade) step * 10.0**decade)
        set ytics add (sprintf("%g", step * 10.0**decade) step * 10.0**decade)
    }
}


if (output[strlen(output) - 3:] eq ".svg") {
    set terminal svg size width, height background rgb "white" font "DejaVu Sans,12"
} else {
    set terminal pngcairo size 1.5 * width, 1.5 * height background rgb "white" font "DejaVu Sans,9" fontscale 1.5 \
        linewidth 1.5 pointscale 1.5
}
set output output
set multiplot

# --- the panels -------------------------------------------------------------------------------------------------
unset key
set xlabel "CPU time (s), one thread"
do for [i = 1:count] {
    scene = scene_of(word(panels, i))
    metric = metric_of(word(panels, i))
    left = (i - 1) % columns
    top = (i - 1) / columns
    set lmargin at screen (left * panel_width + 80.0) / width
    set rmargin at screen ((left + 1) * panel_width - 18.0) / width
    set tmargin at screen 1 - (top * panel_height + 34.0) / height
    set bmargin at screen 1 - ((top + 1) * panel_height - 50.0) / height
    set xrange [*:*] # or stats would leave out what is beyond the last panel's ranges
    set yrange [*:*]
    stats lines(scene, "") using (column("seconds")):(column(metric)) name "S" nooutput
    set xrange [S_min_x / 1.25:S_max_x * 1.25]
    set yrange [S_min_y / 1.25:S_max_y * 1.25]
    set title scene
    set ylabel metric eq "rmse" ? "RMSE (display-referred, 0..1)" : "FLIP (mean, 0..1)"
    unset label
    levels = metric eq "rmse" ? 3 : 0 # lines at 1/255, 2/255, 4/255
    do for [k = 1:levels] {
        level = 2.0**(k - 1) / 255
        if (level > S_min_y / 1.2 && level < S_max_y * 1.1) {
            set label sprintf("%d/255", 2**(k - 1)) at graph 0.99, first level right offset 0, 0.45 tc rgb "#707070"
        }
    }
    plot for [k = 1:levels] 2.0**(k - 1) / 255 with lines lc rgb "#909090" lw 1 dt 2, \
        for [curve in measured] lines(scene, curve) using (column("seconds")):(column(metric)) \
            with linespoints lt number(curve)
}

# --- the legend: a plot of nothing but its key, in the strip at the bottom -----------------------------------------
set lmargin at screen 0.02
set rmargin at screen 0.98
set bmargin at screen 0
set tmargin at screen (legend_height - 6.0) / height
unset title
unset xlabel
unset ylabel
unset border
unset tics
unset grid
unset label
set key center center horizontal Left reverse maxrows 2 width 3 samplen 3
set xrange [1:2]
set yrange [1:2]
plot for [curve in measured] NaN with linespoints lt number(curve) title title[number(curve)]
unset multiplot
