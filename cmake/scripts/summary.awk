# SPDX-License-Identifier: GPL-3.0-or-later
# summary.awk report.json: one line per run. Relies on the two-space indentation of `brainshift
# report`: a key's depth is its indentation, and a run ends at the depth where it began.
function number(key, format) {
  return key in value && value[key] != "null" ? sprintf(format, value[key]) : "-"
}
function spread(key) {
  return number(key ".mean", "%.3f") (key ".std" in value ? " +- " number(key ".std", "%.3f") : "")
}
BEGIN {
  layout = "%-11s %-10s %-9s %14s %14s %8s %16s %8s %12s %8s\n"
  printf layout, "scenario", "method", "boundary", "shift mm", "error mm", "tumour %", "craniotomy mm", "cran. %", "penetrating", "p50 s"
}
match($0, /^ *"[^"]*":/) {
  depth = (match($0, /[^ ]/) - 1) / 2
  key = $1
  gsub(/[":]/, "", key)
  path[depth] = depth > 2 ? path[depth - 1] "." key : key
  text = $0
  sub(/^ *"[^"]*": */, "", text)
  gsub(/^"|",?$|,$/, "", text)
  value[path[depth]] = text
}
/^  [}]/ {
  latency = value["latency_ms.p50"] + 0
  printf layout, value["scenario"], value["method"], value["boundary"], spread("error_mm.initial"), spread("error_mm.cross"),
    number("recovery_pct", "%.1f"), spread("error_mm.craniotomy_displacement"),
    number("craniotomy_displacement_recovery_pct", "%.1f"), number("contact.penetrating", "%d"),
    (latency > 0 ? sprintf("%.3f", latency / 1000) : "-")
  split("", value)
}
