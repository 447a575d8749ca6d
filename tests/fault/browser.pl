# A browser that looks twice at every page of each weft render --http that comes to PORT of 127.0.0.1, and then at its
# state to the end; and again if the connection breaks. Prints a line for each answer that has come whole, "PATH
# STATUS", and one that says what is wrong, if something is: a whole answer has the content that its head promises. Ends
# when it is told to, or after two hours.
#
#   perl browser.pl PORT
use strict;
use warnings;
use JSON::PP;
use Socket;

my ($port) = @ARGV;
my @paths = qw(/ /api/job /api/log /api/history /api/rows?job=0 /preview.png?job=0 /preview.png?job=0&show=samples
    /preview.png?job=0&show=error /metrics /nothing);
$| = 1;
alarm 7200;
$SIG{PIPE} = 'IGNORE'; # the end that goes is noticed by reading

sub pause { select undef, undef, undef, $_[0] }

sub take_more {
    my ($socket, $data) = @_;
    return sysread $socket, $$data, 65536, length $$data;
}

# The head and the body of an answer; nothing if the connection ends before.
sub take_answer {
    my ($socket) = @_;
    my ($data, $end) = ('', -1);
    while (($end = index $data, "\r\n\r\n") < 0) { take_more($socket, \$data) or return }
    my $head = substr $data, 0, $end + 2;
    my ($size) = $head =~ /^Content-Length: (\d+)\r$/mi or die "no length\n";
    while (length $data < $end + 4 + $size) { take_more($socket, \$data) or return }
    return ($head, substr $data, $end + 4);
}

# Dies of what is wrong. A render that begins or ends has not all there is.
sub check {
    my ($path, $status, $head, $body) = @_;
    my ($type) = $head =~ /^Content-Type: ([^\r;]*)/mi;
    die "status $status\n" unless $status == ($path eq '/nothing' ? 404 : 200) || $status == 503 ||
        ($status == 404 && $path =~ /job=0/);
    decode_json($body) if $type eq 'application/json';
    die "no whole PNG\n" if $type eq 'image/png' && $body !~ /^\x89PNG\r\n\x1a\n.*IEND\xaeB`\x82$/s;
    die "no whole metrics\n" if $status == 200 && $path eq '/metrics' && $body !~ /^weft_build_info.*\n$/ms;
}

# Returns the body of the answer; nothing if the connection ends before.
sub look {
    my ($socket, $path) = @_;
    syswrite $socket, "GET $path HTTP/1.1\r\nHost: localhost\r\n\r\n";
    my ($head, $body) = take_answer($socket) or return;
    my ($status) = $head =~ /^HTTP\/1\.1 (\d+) / or die "no status\n";
    check($path, $status, $head, $body);
    print "$path $status\n";
    return $body;
}

# After the last state it says nothing more, until the connection ends.
sub visit {
    my ($socket) = @_;
    for my $path (@paths, @paths) { defined look($socket, $path) or return }
    while (defined(my $job = look($socket, '/api/job'))) {
        return take_more($socket, \$job) if $job =~ /"state":"(done|failed)"/;
        pause(0.005);
    }
}

while (1) {
    socket my $socket, PF_INET, SOCK_STREAM, 0 or die "socket: $!";
    if (!connect $socket, sockaddr_in($port, INADDR_LOOPBACK)) {
        pause(0.002);
        next;
    }
    eval { visit($socket); 1 } or print "wrong: $@";
}
