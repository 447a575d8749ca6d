# Browsers that mean no good: hostile_http.pl PORT SECONDS [CONNECTIONS]. So many connections at a time (500), which say
# nothing, send their request a byte now and then, ask for what is large and do not read it, send heads without end,
# bodies, or noise; whoever is cut off comes again. Prints how many connections it made.
use strict;
use warnings;
use IO::Select;
use IO::Socket::INET;
use Time::HiRes qw(sleep time);

my ($port, $seconds, $many) = (@ARGV, 500);
my $end = time + $seconds;
my ($made, @open) = (0);
my @kinds = (
    sub { },                                                                     # silence
    sub { $_[0]->syswrite(substr "GET / HTTP/1.1\r\nHost: x\r\nX: ", $_[1] % 9, 1) }, # dribbles
    sub { $_[0]->syswrite("GET /preview.png HTTP/1.1\r\nHost: localhost\r\n\r\n") }, # never reads
    sub { $_[0]->syswrite("GET /api/job HTTP/1.1\r\nHost: localhost\r\n\r\n" x 50) },
    sub { $_[0]->syswrite("GET / HTTP/1.1\r\nX: " . "a" x 65536) },
    sub { $_[0]->syswrite("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000000\r\n\r\n" . "b" x 65536) },
    sub { $_[0]->syswrite("GET / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\nffffff\r\n" . "c" x 65536) },
    sub { $_[0]->syswrite(join '', map { chr int rand 256 } 1 .. 4096) },
    sub { $_[0]->syswrite("GET /" . "../" x 300 . "etc/passwd%00%ff%zz HTTP/1.1\r\nHost: localhost\r\n\r\n") },
);
$SIG{PIPE} = 'IGNORE';
srand 1;
while (time < $end) {
    @open = grep { defined $_->[0]->connected } @open;
    while (@open < $many && time < $end) {
        my $socket = IO::Socket::INET->new(PeerAddr => '127.0.0.1', PeerPort => $port, Timeout => 1) or last;
        $socket->blocking(0);
        push @open, [$socket, $kinds[$made++ % @kinds]];
    }
    $_->[1]->($_->[0], int rand 100) for @open;
    my @ended = IO::Select->new(map { $_->[0] } @open)->can_read(0);
    my %cut = map { $_ => 1 } grep { !sysread($_, my $ignored, 64) } grep { rand() < 0.2 } @ended;
    @open = grep { !$cut{$_->[0]} || !close $_->[0] } @open;
    sleep 0.05;
}
print "$made\n";
