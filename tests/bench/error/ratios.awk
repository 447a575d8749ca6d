# Reads results.csv (see run) and prints, in Markdown, how the CPU times for equal RMSE compare. A curve goes through
# its points in the order of their times, without those that another point beats in both time and error; between points
# it is a straight line of log(seconds) over log(RMSE). POV-Ray has a curve for each of its methods and one through the
# points of all; the lowest counts. A level beyond the ends of a curve is not extrapolated: there the time is known only
# to be at most that of the quickest point (which is better than asked for already), or more than that of the slowest,
# and what follows from it is marked ≤ or ≥ and left out of the mean.
BEGIN {
    FS = ","
    level_count = split("4 2 1", levels, " ") # in 1/255
    peers = "povray povray-am1 povray-am2 povray-fixed tachyon"
}

FNR == 1 {
    for (i = 1; i <= NF; i++)
        column[$i] = i
    next
}

{
    scene = $column["scene"]
    if (!(scene in seen)) {
        seen[scene]
        scenes[++scene_count] = scene
    }
    measured[$column["curve"]]
    add(scene SUBSEP $column["curve"], $column["seconds"] + 0, $column["rmse"] + 0)
    if ($column["curve"] ~ /^povray-/)
        add(scene SUBSEP "povray", $column["seconds"] + 0, $column["rmse"] + 0)
}

END {
    table("Best of POV-Ray and Tachyon over weft --error", peers, "weft-adaptive")
    table("weft --samples over weft --error", "weft-fixed", "weft-adaptive")
    table("Best of POV-Ray and Tachyon over weft --samples", peers, "weft-fixed")
}

# Keeps the curve's points in the order of their times.
function add(curve, time, error,    i) {
    for (i = count[curve]++; i > 0 && seconds[curve, i] > time; i--) {
        seconds[curve, i + 1] = seconds[curve, i]
        rmse[curve, i + 1] = rmse[curve, i]
    }
    seconds[curve, i + 1] = time
    rmse[curve, i + 1] = error
}

# Seconds for the curve to come down to the RMSE. Sets `bound`: "=", "<" at most that, ">" more than that, "" no curve.
function time_at(curve, level,    i, time, error, last_time, last_error) {
    bound = ""
    for (i = 1; i <= count[curve]; i++) {
        if (bound != "" && rmse[curve, i] >= error)
            continue
        last_time = time
        last_error = error
        time = seconds[curve, i]
        error = rmse[curve, i]
        if (error <= level && bound == "") {
            bound = error == level ? "=" : "<"
            return time
        }
        bound = error <= level ? "=" : ">"
        if (bound == "=")
            return exp(log(last_time) + log(time / last_time) * log(level / last_error) / log(error / last_error))
    }
    return time
}

# The quickest of the scene's named curves, as time_at; sets `best` to its name. Those that do not come down to the
# level count only where none does.
function best_time(scene, names, level,    list, i, n, time, least, least_bound) {
    least_bound = ""
    n = split(names, list, " ")
    for (i = 1; i <= n; i++) {
        time = time_at(scene SUBSEP list[i], level)
        if (bound == "" || (bound == ">" && least_bound ~ /[=<]/))
            continue
        if (least_bound == "" || (least_bound == ">" && bound != ">") || time < least) {
            least = time
            least_bound = bound
            best = list[i]
        }
    }
    bound = least_bound
    return least
}

# The ratio of two times as text; sets `exact` to it, or to 0 where one of them is only a bound.
function ratio(upper, upper_bound, lower, lower_bound,    at_least, at_most) {
    at_least = upper_bound == ">" || lower_bound == "<"
    at_most = upper_bound == "<" || lower_bound == ">"
    exact = 0
    if (upper_bound == "" || lower_bound == "" || (at_least && at_most))
        return "–"
    if (!at_least && !at_most)
        exact = upper / lower
    return (at_least ? "≥ " : at_most ? "≤ " : "") sprintf("%.2f", upper / lower)
}

# One row for a scene: the quickest of the curves named `uppers` over the curve `lower`, by levels.
function print_scene(scene, uppers, lower,    j, upper, upper_bound, lower_time, text) {
    printf "| %s |", scene
    for (j = 1; j <= level_count; j++) {
        upper = best_time(scene, uppers, levels[j] / 255)
        upper_bound = bound
        lower_time = time_at(scene SUBSEP lower, levels[j] / 255)
        text = ratio(upper, upper_bound, lower_time, bound)
        printf " %s%s |", text, uppers ~ / / && upper_bound ~ /[=<]/ && text != "–" ? " (" best ")" : ""
        log_sum[j] += exact ? log(exact) : 0
        exact_count[j] += exact > 0
    }
    print ""
}

function table(title, uppers, lower,    i, j, rule) {
    if (!(lower in measured))
        return
    printf "%s, CPU seconds at equal RMSE:\n\n| scene |", title
    for (j = 1; j <= level_count; j++) {
        printf " %s/255 |", levels[j]
        rule = rule "---|"
        log_sum[j] = exact_count[j] = 0
    }
    print "\n|---|" rule
    for (i = 1; i <= scene_count; i++)
        print_scene(scenes[i], uppers, lower)
    printf "| geometric mean (of scenes) |"
    for (j = 1; j <= level_count; j++) {
        if (exact_count[j])
            printf " %.2f (%d) |", exp(log_sum[j] / exact_count[j]), exact_count[j]
        else
            printf " – |"
    }
    print "\n"
}
