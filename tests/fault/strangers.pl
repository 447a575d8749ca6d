#!/usr/bin/perl
# strangers.pl PORT SILENT GARBAGE HALF: that many connections to 127.0.0.1:PORT which say nothing, which say what is no
# ZMTP, and which begin as ZMTP does and stop anywhere. Says "ready" when all are there, and holds them until it is
# ended; those that are closed on it come again.
use strict;
use warnings;
use IO::Select;
use Socket;

my ($port, @counts) = @ARGV;
my $greeting = "\xff" . "\0" x 8 . "\x7f\3\1NULL" . "\0" x 16 . "\0" . "\0" x 31;
my $ready = "\4\x26\5READY\13Socket-Type\0\0\0\6DEALER\10Identity\0\0\0\0";
my @words = (
    sub { '' },
    sub { join '', map { chr int rand 256 } 1 .. 1 + rand 2000 },
    sub { substr $greeting . $ready, 0, 1 + int rand length "$greeting$ready" },
);
my (%kinds, $select);
$SIG{PIPE} = 'IGNORE';
srand 1;

sub knock {
    my ($kind) = @_;
    socket my $socket, PF_INET, SOCK_STREAM, 0 or die "socket: $!";
    connect $socket, sockaddr_in($port, INADDR_LOOPBACK) or die "connect: $!";
    syswrite $socket, $words[$kind]->();
    $kinds{$socket} = $kind;
    $select->add($socket);
}

$select = IO::Select->new;
for my $kind (0 .. $#counts) {
    knock($kind) for 1 .. $counts[$kind];
}
$| = 1;
print "ready\n";
while (1) {
    for my $socket ($select->can_read) {
        next if sysread $socket, my $heard, 4096;
        my $kind = delete $kinds{$socket};
        $select->remove($socket);
        close $socket;
        select undef, undef, undef, 0.001;
        knock($kind);
    }
}
