# One end of a ZeroMQ connection by hand (ZMTP 3.0 with the NULL mechanism, rfc.zeromq.org/spec/23), to say to weft's
# programs what they would not say to one another. Messages are lines of hexadecimal digits.
#
#   perl zmtp.pl dealer PORT [TIMES]
#                                connects to 127.0.0.1:PORT, sends the message on standard input (so often, without
#                                hearing what is answered), prints the first answer
#   perl zmtp.pl router          listens on a free port and prints it; then prints the first message that comes, and
#                                sends the message on standard input
use strict;
use warnings;
use IO::Socket::INET;

my ($role, $port, $times) = @ARGV;
$| = 1;
alarm 60; # whatever happens, this ends
$SIG{PIPE} = 'IGNORE'; # the end that goes is noticed by reading

sub take {
    my ($socket, $size) = @_;
    my $data = '';
    while (length $data < $size) {
        $socket->sysread($data, $size - length $data, length $data) or die "the connection ended\n";
    }
    return $data;
}

# Returns a frame's flags (1: more follow, 2: the size has eight bytes, 4: a command) and its body.
sub take_frame {
    my ($socket) = @_;
    my $flags = ord take($socket, 1);
    my $size = $flags & 2 ? unpack('Q>', take($socket, 8)) : ord take($socket, 1);
    return ($flags, take($socket, $size));
}

sub put_frame {
    my ($socket, $flags, $body) = @_;
    my $long = length $body > 255;
    $socket->syswrite(chr($flags | ($long ? 2 : 0)) . pack($long ? 'Q>' : 'C', length $body) . $body);
}

sub shake_hands {
    my ($socket) = @_;
    $socket->syswrite("\xFF" . "\0" x 8 . "\x7F\3\0" . pack('a20', 'NULL') . "\0" x 32);
    take($socket, 64);
    put_frame($socket, 4, "\5READY\13Socket-Type" . pack('N/a*', uc $role));
    take_frame($socket);
}

sub take_message {
    my ($socket) = @_;
    my ($flags, $body);
    do { ($flags, $body) = take_frame($socket) } while $flags & 4;
    return $body;
}

my $socket;
if ($role eq 'dealer') {
    $socket = IO::Socket::INET->new(PeerAddr => '127.0.0.1', PeerPort => $port) or die "cannot connect: $!\n";
} else {
    my $server = IO::Socket::INET->new(LocalAddr => '127.0.0.1', Listen => 1) or die "cannot listen: $!\n";
    print $server->sockport, "\n";
    $socket = $server->accept;
}
shake_hands($socket);
print unpack('H*', take_message($socket)), "\n" if $role eq 'router';
my $line = <STDIN>;
if (defined $line) {
    chomp $line;
    put_frame($socket, 0, pack('H*', $line)) for 1 .. $times // 1;
}
print unpack('H*', take_message($socket)), "\n" if $role eq 'dealer';
take_frame($socket) while $role eq 'router'; # until the other end has gone
