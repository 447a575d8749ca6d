#!/bin/bash
# weft render --http: pages and data, who gets them and who does not, and what hostile browsers cannot do to a render.
. tests/tap.sh
PATH=$PATH:$(realpath -m "${WEFT_WEB:-build/web}") # where promtool may be

picture=$tmp/a.png

# watched LABEL COMMAND...: starts it and waits until its status page is there; leaves $pid and $web, its port, behind.
watched() {
    start "$@"
    wait_until "grep -q 'status page at' '$tmp/$1.err'" 60
    web=$(sed -nE 's/.*status page at [^ ]*:([0-9]+)\/.*/\1/p' "$tmp/$1.err")
}

# ask METHOD PATH [HEADER]...: the answer's head in $head, its body in the file $body. Host is localhost unless a header
# says otherwise.
body=$tmp/body
ask() {
    local method=$1 path=$2 host=('Host: localhost')
    shift 2
    [[ "$*" == *Host:* ]] && host=()
    : >"$tmp/answer"
    exec 9<>"/dev/tcp/127.0.0.1/$web" || return 1
    # A process of its own: refused in the middle of a head, it alone ends of SIGPIPE.
    (printf '%s\r\n' "$method $path HTTP/1.1" "${host[@]}" "$@" 'Connection: close' '' >&9)
    timeout 20 cat <&9 >"$tmp/answer"
    exec 9>&-
    perl -e 'local $/; open F, "<:raw", $ARGV[0]; $_ = <F>; s/^(.*?)\r\n\r\n//s; ($head = $1) =~ tr/\r//d;
        open B, ">:raw", $ARGV[1]; print B $_; print $head' "$tmp/answer" "$body" >"$tmp/head"
    head=$(cat "$tmp/head")
} 2>/dev/null

# answers CODE METHOD PATH [HEADER]...
answers() {
    local code=$1
    shift
    ask "$@"
    like "$*: $code" "$head" "^HTTP/1.1 $code "
}

# job EXPRESSION: the Perl expression holds for the state of the first job, $_.
job() {
    ask GET /api/job && perl -MJSON::PP -e 'local $/; open F, "<", $ARGV[0]; $_ = decode_json(<F>)->{jobs}[0];
        exit !eval $ARGV[1]' "$body" "$1"
} 2>/dev/null

# --- usage ----------------------------------------------------------------------------------------------------
exits 2 "an address that is none" "$weft" render "${slow[@]}" --http somewhere -o "$picture"
exits 2 "an address of the network without a token" "$weft" render "${slow[@]}" --http 0.0.0.0:0 -o "$picture"
like "is refused with a way out" "$err" 'http://0\.0\.0\.0:0/ can be reached from other machines.*--http-token FILE'
exits 2 "a token without a page" "$weft" render "${slow[@]}" --http-token x -o "$picture"
hold_port
perl -MSocket -e '$| = 1; socket(S, PF_INET, SOCK_STREAM, 0); setsockopt(S, SOL_SOCKET, SO_REUSEADDR, 1);
    bind(S, sockaddr_in($ARGV[0], INADDR_LOOPBACK)) && listen(S, 1) or die; print "there\n"; sleep' \
    "$port" >"$tmp/holder" &
started+=($!)
wait_until "[ -s '$tmp/holder' ]" 60
exits 1 "a port that is taken" "$weft" render "${slow[@]}" --http "$port" -o "$picture"
like "is named" "$err" "cannot listen at http://127\.0\.0\.1:$port/: another program does already"
absent "$picture" && report 0 "and nothing is rendered"
echo 0123456789abcdef >"$tmp/token"
chmod 644 "$tmp/token"
exits 3 "a token that others can read" "$weft" render "${slow[@]}" --http 0 --http-token "$tmp/token" -o "$picture"
like "is not used" "$err" 'token: expected a token that only its owner can read \(mode 0600\), found mode 0644'
chmod 600 "$tmp/token"

# --- what is served -------------------------------------------------------------------------------------------
# Nobody renders until a worker is started below, so that there is time to look.
watched idle "$weft" render "${slow[@]}" --workers 0 --listen "ipc://$tmp/socket" --http 0 -o "$picture"
idle=$pid
answers 200 GET /
like "it is the page" "$(cat "$body")" '<title>weft</title>'
policy="default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
for header in "Content-Security-Policy: $policy" \
    'X-Content-Type-Options: nosniff' 'Cache-Control: no-store' 'Content-Type: text/html; charset=utf-8' \
    'Cross-Origin-Resource-Policy: same-origin'; do
    is "with $header" "$(grep -Fx "$header" <<<"$head")" "$header"
done
ok "it names nothing from elsewhere" test -z "$(grep -E '(src|href)="(https?:)?//' "$body")"
for path in style.css icon.svg $(basename -a coordinator/page/*.js); do
    answers 200 GET "/$path"
    same_bytes "/$path is the file" "$body" "coordinator/page/$path"
done
answers 200 HEAD /
ok "without a body" test ! -s "$body"
answers 200 GET /api/job
like "as JSON" "$head" '^Content-Type: application/json$'
said=$(perl tests/farm/as_promised.pl coordinator/snapshot.schema.json "$body" lines 2>&1)
report $? "of the snapshot's schema" || note "$said"
answers 200 GET /api/log
like "with what was said" "$(cat "$body")" '"level":"info","text":"status page at'
answers 200 GET /api/history
answers 200 GET '/api/rows?job=0'
answers 200 GET '/preview.png?job=0&show=samples'
is "a PNG" "$(head -c 8 "$body" | od -An -tx1)" ' 89 50 4e 47 0d 0a 1a 0a'
tag=$(sed -n 's/^ETag: //p' <<<"$head")
answers 304 GET '/preview.png?job=0&show=samples' "If-None-Match: $tag"
answers 200 GET '/preview.png?job=0&show=samples' 'If-None-Match: "other"'
answers 200 GET /metrics
like "in Prometheus' format" "$head" '^Content-Type: text/plain; version=0\.0\.4; charset=utf-8$'
like "of this render" "$(cat "$body")" "^weft_job|^weft_jobs\{state=\"waiting\"\} 1$"
if command -v promtool >/dev/null; then
    said=$(promtool check metrics <"$body" 2>&1)
    report $? "promtool has nothing against them" || note "$said"
    is "nor any advice" "$said" ''
else
    skip "promtool checks the metrics" "there is no promtool here"
fi

# --- what is refused ------------------------------------------------------------------------------------------
for path in /nothing /style.css/ '/preview.png?job=1' '/preview.png?show=x' '/api/rows?job=7' \
    /../etc/passwd /%2e%2e/etc/passwd; do
    answers 404 GET "$path"
done
for method in POST PUT DELETE OPTIONS PATCH; do
    answers 405 $method /api/job
done
like "saying what is allowed" "$head" '^Allow: GET, HEAD$'
for host in evil.example "localhost.evil.example:$web" 192.0.2.1; do
    answers 421 GET /api/job "Host: $host"
done
answers 200 GET /api/job "Host: 127.0.0.1:$web"
answers 200 GET /api/job "Host: [::1]:8080"
ask GET /api/job 'X-Long: '"$(head -c 30000 /dev/zero | tr '\0' a)"
like "a head without end is refused" "$head" '^HTTP/1.1 (431|413|400) |^$'
answers 200 GET / # and it lives

# --- hostile browsers, while a render goes on -----------------------------------------------------------------
start hostile perl tests/farm/hostile_http.pl "$web" 8
hostile=$pid
"$worker" "ipc://$tmp/socket" --once >"$tmp/worker.out" 2>&1 &
started+=($!)
wait "$hostile"
like "hundreds of hostile connections were made" "$(cat "$tmp/hostile.out")" '^[0-9]{3,}$'
ends 0 "the render ends well beside them" "$idle" 60 idle
exits 0 "the same without a page" "$weft" render "${slow[@]}" -o "$tmp/alone.png"
same_bytes "has the same bytes" "$tmp/alone.png" "$picture"

# --- the picture so far ---------------------------------------------------------------------------------------
# until_done FOLDER: looks at the state until it is done, and at once, for the page then ends soon, takes a picture and
# the rows as well.
until_done() {
    perl -MHTTP::Tiny -MJSON::PP -e 'my ($port, $folder) = @ARGV; my $http = HTTP::Tiny->new(timeout => 20);
        sub take { my $answer = $http->get("http://localhost:$port$_[0]");
            $answer->{success} or die "$_[0]: $answer->{status} $answer->{reason}\n"; $answer->{content} }
        sub keep { open F, ">:raw", "$folder/$_[0]" or die; print F take($_[1]); close F }
        select undef, undef, undef, 0.05 while decode_json(take("/api/job"))->{jobs}[0]{state} ne "done";
        keep("last.png", "/preview.png"); keep("rows", "/api/rows?job=0")' "$web" "$1" 2>&1
}

watched seen "$weft" render "${slow[@]}" --band 5 --http 0 -o "$tmp/seen.png"
wait_until "job '\$_->{rows_done} > 0 && \$_->{state} eq \"running\"'" 60
answers 200 GET /preview.png
cp "$body" "$tmp/early.png"
is "it is seen until it is done, and what there is then" "$(until_done "$tmp")" ''
is "all rows have a worker" "$(perl -MJSON::PP -e 'local $/; open F, $ARGV[0]; my $n = 0;
    $n += $_->{worker} ? $_->{rows} : 0 for @{decode_json(<F>)->{rows}}; print $n' "$tmp/rows")" "$slow_rows"
ends 0 "the render ends soon after it was seen to be done" "$pid" 10 seen
exits 0 "at last the preview is the picture" "$weft" compare "$tmp/last.png" "$tmp/seen.png" --max-rmse 0
exits 1 "before it was not" "$weft" compare "$tmp/early.png" "$tmp/seen.png" --max-rmse 0

# --- resuming -------------------------------------------------------------------------------------------------
# cut_and_go_on NAME "OPTIONS OF THE FIRST" "OPTIONS OF THE SECOND"
cut_and_go_on() {
    local name=$1 output=$tmp/resumed.png first second
    read -ra first <<<"$2"
    read -ra second <<<"$3"
    start cut "$weft" render "${slow[@]}" --band 5 --progress json "${first[@]}" -o "$output"
    wait_until "has_rows cut 10" 60
    slay "$pid"
    exits 0 "$name" "$weft" render "${slow[@]}" "${second[@]}" -o "$output"
    like "goes on from the journal" "$err" 'going on from its journal: [1-9]'
    same_bytes "to the same bytes" "$tmp/alone.png" "$output"
    rm -f "$output"
}
cut_and_go_on "a render that is watched when it goes on" "" "--http 0"
cut_and_go_on "one that is watched no more" "--http 0" ""
cut_and_go_on "one that is watched again" "--http 0" "--http 0"

# --- the token ------------------------------------------------------------------------------------------------
watched guarded "$weft" render "${slow[@]}" --workers 0 --listen "ipc://$tmp/socket2" --http 127.0.0.1:0 \
    --http-token "$tmp/token" -o "$tmp/guarded.png"
is "the token is not in what is said" "$(grep -c 0123456789abcdef "$tmp/guarded.err")" 0
answers 200 GET /
for path in /api/job /api/log /api/history '/api/rows?job=0' /preview.png /metrics; do
    answers 401 GET "$path"
    like "saying how" "$head" '^WWW-Authenticate: Bearer'
    answers 401 GET "$path" 'Authorization: Bearer 0123456789abcdee'
    answers 200 GET "$path" 'Authorization: Bearer 0123456789abcdef'
done
kill -TERM "$pid"
ends 143 "a render that nobody joined is ended" "$pid" 10 guarded

finish
